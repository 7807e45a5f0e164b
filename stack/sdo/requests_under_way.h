// SPDX-License-Identifier: Apache-2.0
// SDO requests between the line and the bus: whether the newest one to a default server was
// acknowledged. Of a bus that reports no acknowledgements none counts as under way.
#pragma once

#include <array>
#include <cstdint>

#include "stack/can/cob_id.h"
#include "stack/can/frame.h"

namespace linegate::sdo {

class RequestsUnderWay {
 public:
  // A frame of any service was handed out to the bus. number: from 1 on, in the order of the
  // frames; 0 if the bus reports no acknowledgements.
  void handed_out(const can::Frame& frame, std::uint64_t number) {
    if ((frame.id & ~kNodeBits) == can::kSdoRequestBase && !frame.extended()) [[unlikely]] {
      newest_[frame.id & kNodeBits] = number;
    }
  }
  // The frames up to that number have ended: acknowledged, or lost.
  void ended(std::uint64_t number) { ended_ = number; }

  // node: 1 to 127.
  bool any(std::uint8_t node) const { return newest_[node & kNodeBits] > ended_; }

 private:
  static constexpr std::uint32_t kNodeBits = 0x7F;

  std::array<std::uint64_t, kNodeBits + 1> newest_{};  // by node-ID
  std::uint64_t ended_ = 0;
};

}  // namespace linegate::sdo
