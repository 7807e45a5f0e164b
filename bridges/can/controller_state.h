// SPDX-License-Identifier: Apache-2.0
// What the kernel's netlink interface says of a CAN controller.
#pragma once

#include "bridges/can/controller_setup.h"
#include "stack/can/bus_state.h"

namespace linegate::can_bridge {

struct ControllerReport {
  // Its fault confinement state; error_active for interfaces without a controller (vcan) and when
  // the kernel does not say.
  can::BusState state = can::BusState::error_active;
  // What it is set to, as far as its driver says; nothing of an interface without a controller.
  ControllerSetup settings;
};

ControllerReport controller_report(int interface_index);

}  // namespace linegate::can_bridge
