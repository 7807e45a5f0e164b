// SPDX-License-Identifier: Apache-2.0
// Error frames of the kernel (linux/can/error.h) as bus events.
#pragma once

#include <linux/can.h>

#include "bridges/can/channel.h"
#include "stack/base/time.h"
#include "stack/can/bus_state.h"

namespace linegate::can_bridge {

// Assembles the bus state from successive error frames.
class ErrorDecoder {
 public:
  // Precondition: raw has CAN_ERR_FLAG. Pushes at most three events, in this order: errors, frames
  // that the controller lost, and the new state if it changed.
  void decode(const canfd_frame& raw, Instant time, BusEvents& events);

  // Sets a state that is known from another source; pushes an event if it is new.
  void set_state(can::BusState state, Instant time, BusEvents& events);

  can::BusState state() const { return state_; }

 private:
  void change(can::BusState state, Instant time, BusEvents& events);

  can::BusState state_ = can::BusState::unknown;
  std::uint8_t transmit_errors_ = 0;
  std::uint8_t receive_errors_ = 0;
};

// The inverse of ErrorDecoder, for errors and for controller states. Returns false, and leaves raw
// unchanged, if there is no such error frame.
bool encode_error(const can::BusEvent& event, canfd_frame& raw);

}  // namespace linegate::can_bridge
