// SPDX-License-Identifier: Apache-2.0
// Opens a CAN_RAW socket on a network interface, and reads the state of its controller.
#pragma once

#include <string>

#include "bridges/can/controller_setup.h"
#include "stack/can/bus_state.h"

namespace linegate::can_bridge {

struct OpenedInterface {
  int descriptor = -1;  // -1: not opened, see error
  int error = 0;        // errno; EMEDIUMTYPE: the interface is no CAN interface
  bool fd = false;      // CAN FD frames can be sent (MTU 72)
  can::BusState state = can::BusState::unknown;
  ControllerSetup settings;  // what the controller is set to
};

// A socket bound to the interface that is up: non-blocking, with time stamps, own echoes, error
// frames and the count of lost frames. receive_buffer: SO_RCVBUF in bytes. One that is down is set
// up, if setup says how.
OpenedInterface open_interface(const std::string& name, int receive_buffer,
                               const ControllerSetup& setup = {});

}  // namespace linegate::can_bridge
