// SPDX-License-Identifier: Apache-2.0
// The state of a CAN controller as the kernel reports it over netlink.
#pragma once

#include "bridges/can/controller_setup.h"
#include "stack/can/bus_state.h"

namespace linegate::can_bridge {

struct ControllerReport {
  // The fault confinement state. error_active for interfaces without a controller (vcan) and where
  // the kernel does not report one.
  can::BusState state = can::BusState::error_active;
  // The settings that the driver reports; empty for an interface without a controller.
  ControllerSetup settings;
};

ControllerReport controller_report(int interface_index);

}  // namespace linegate::can_bridge
