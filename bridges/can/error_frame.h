// SPDX-License-Identifier: Apache-2.0
// Error frames of the kernel (linux/can/error.h) as bus events.
#pragma once

#include <linux/can.h>

#include "bridges/can/channel.h"
#include "stack/base/time.h"
#include "stack/can/bus_state.h"

namespace linegate::can_bridge {

// Keeps the bus state that error frames tell piece by piece.
class ErrorDecoder {
 public:
  // raw has CAN_ERR_FLAG. Pushes at most three events, in this order: the errors if it tells any,
  // frames the controller lost, and the new state if it changed.
  void decode(const canfd_frame& raw, Instant time, BusEvents& events);

  // The state became known otherwise: told if it is a new one.
  void set_state(can::BusState state, Instant time, BusEvents& events);

  can::BusState state() const { return state_; }

 private:
  void change(can::BusState state, Instant time, BusEvents& events);

  can::BusState state_ = can::BusState::unknown;
  std::uint8_t transmit_errors_ = 0;
  std::uint8_t receive_errors_ = 0;
};

// An error frame that tells ErrorDecoder the same: errors, or a state that a controller has. False
// if there is none: raw is left alone.
bool encode_error(const can::BusEvent& event, canfd_frame& raw);

}  // namespace linegate::can_bridge
