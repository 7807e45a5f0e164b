// SPDX-License-Identifier: Apache-2.0
// Whether a frame can exist on a bus at all.
#pragma once

#include "stack/can/frame.h"

namespace linegate::can_bridge {

// False for identifiers and lengths that the frame format does not have, for CAN FD frames where fd
// is false, and for CAN FD remote frames.
inline bool sendable(const can::Frame& frame, bool fd) {
  const std::uint32_t highest = frame.extended() ? 0x1FFF'FFFFU : 0x7FFU;
  if (frame.id > highest) {
    return false;
  }
  if (!frame.fd()) {
    return frame.length <= can::kMaxClassicData;
  }
  return fd && !frame.remote() && frame.length <= can::kMaxFdData &&
         can::fd_length(frame.length) == frame.length;
}

}  // namespace linegate::can_bridge
