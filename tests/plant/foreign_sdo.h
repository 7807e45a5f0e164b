// SPDX-License-Identifier: Apache-2.0
// An SDO server that is not of this house, in front of that of a simulated device: it has no block
// transfer, or aborts a transfer that is open upon any command that is not its next one, as
// CANopenNode and lely-core do.
#pragma once

#include <cstdint>
#include <optional>

#include "stack/can/frame.h"

namespace linegate::plant {

class ForeignSdo {
 public:
  enum class Blocks : std::uint8_t { served, refused, ignored };

  ForeignSdo(std::uint8_t node, Blocks blocks) : node_(node), blocks_(blocks) {}

  // What the device's own server does not get, and what is answered in its place.
  struct Verdict {
    bool taken = false;
    std::optional<can::Frame> answer{};
    bool abort_device = false;  // the frame goes to the device as an abort of the open transfer
  };
  Verdict receive(const can::Frame& frame);
  // What the device sends.
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
