// SPDX-License-Identifier: Apache-2.0
// The SDO server of another manufacturer, in front of the server of a simulated device. It has no
// block transfer, or it aborts an open transfer on any command that is not its next one, like
// CANopenNode and lely-core.
#pragma once

#include <cstdint>
#include <optional>

#include "stack/can/frame.h"

namespace linegate::plant {

class ForeignSdo {
 public:
  enum class Blocks : std::uint8_t { served, refused, ignored };

  ForeignSdo(std::uint8_t node, Blocks blocks) : node_(node), blocks_(blocks) {}

  // Whether a request is kept from the server of the device, and the response that is sent instead.
  struct Verdict {
    bool taken = false;
    std::optional<can::Frame> answer{};
    // The device receives an abort of the open transfer instead of the frame
    bool abort_device = false;
  };
  Verdict receive(const can::Frame& frame);
  // Call it with the frames that the device sends.
  void follow(const can::Frame& frame);

 private:
  can::Frame refusal(const can::Frame& request) const;

  std::uint8_t node_;
  Blocks blocks_;
  enum class Open : std::uint8_t {
    nothing,
    upload,
    block_download,
    block_upload_initiate,
    block_upload
  };
  Open open_ = Open::nothing;
};

}  // namespace linegate::plant
