// SPDX-License-Identifier: Apache-2.0
// Frames as the kernel carries them: struct can_frame (16 bytes) and struct canfd_frame (72 bytes).
#pragma once

#include <cstddef>

#include <linux/can.h>

#include "stack/can/frame.h"

namespace linegate::can_bridge {

// Fills raw and returns the number of bytes to send: CAN_MTU or CANFD_MTU. Precondition:
// sendable(frame, true).
std::size_t encode(const can::Frame& frame, canfd_frame& raw);

// Fills out, except its time. Returns false if `bytes` is neither size or the length is impossible.
// Precondition: raw is not an error frame (CAN_ERR_FLAG).
bool decode(const canfd_frame& raw, std::size_t bytes, can::Frame& out);

}  // namespace linegate::can_bridge
