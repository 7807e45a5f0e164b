// SPDX-License-Identifier: Apache-2.0
// Whether the last SDO request to each default server was acknowledged on the bus, or on a line of
// CANopen FD the last USDO request to each server. On a bus that does not report acknowledgements,
// no request counts as under way.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "stack/can/cob_id.h"
#include "stack/can/frame.h"

namespace linegate::sdo {

class RequestsUnderWay {
 public:
  // Call it with each frame handed out to the bus, of any service. number: counts the frames from
  // 1; 0 if the bus does not report acknowledgements.
  void handed_out(const can::Frame& frame, std::uint64_t number) {
    if ((frame.id & ~kNodeBits) == can::kSdoRequestBase && !frame.extended()) [[unlikely]] {
      // The identifier of a USDO request has the node-ID of its client, byte 0 that of the server.
      const auto node = frame.fd() ? std::to_integer<std::uint32_t>(frame.data[0]) : frame.id;
      newest_[node & kNodeBits] = number;
    }
  }
  // The frames up to that number were acknowledged or lost.
  void ended(std::uint64_t number) { ended_ = number; }

  // Whether a request to that node (1 to 127) is not acknowledged yet.
  bool any(std::uint8_t node) const { return newest_[node & kNodeBits] > ended_; }

 private:
  static constexpr std::uint32_t kNodeBits = 0x7F;

  std::array<std::uint64_t, kNodeBits + 1> newest_{};  // by node-ID
  std::uint64_t ended_ = 0;
};

}  // namespace linegate::sdo
