// SPDX-License-Identifier: Apache-2.0
#include "stack/can/bus_state.h"

namespace linegate::can {

std::string_view name(BusState state) {
  switch (state) {
    case BusState::unknown:
      return "unknown";
    case BusState::error_active:
      return "error-active";
    case BusState::error_warning:
      return "error-warning";
    case BusState::error_passive:
      return "error-passive";
    case BusState::bus_off:
      return "bus-off";
    case BusState::stopped:
      return "stopped";
    case BusState::absent:
      return "absent";
  }
  return "unknown";
}

}  // namespace linegate::can
