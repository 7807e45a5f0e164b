// The fault confinement state of a CAN controller as the kernel's netlink interface tells it.
#pragma once

#include "stack/can/bus_state.h"

namespace linegate::can_bridge {

// error_active for interfaces without a controller (vcan) and when the kernel does not say.
can::BusState controller_state(int interface_index);

}  // namespace linegate::can_bridge
