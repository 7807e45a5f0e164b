// SPDX-License-Identifier: Apache-2.0
// The communication objects that exist in each NMT state (CiA 301, 7.3.2.2.6).
#pragma once

#include "stack/can/dispatch.h"
#include "stack/nmt/state.h"

namespace linegate::nmt {

// Node control and error control are served in every state except Initialising, PDOs and
// SRDOs only in Operational, the others in Pre-operational and Operational. LSS is also served in
// Stopped (CiA 305).
constexpr bool is_served(can::Service service, State state) {
  const bool configurable = state == State::operational || state == State::pre_operational;
  switch (service) {
    case can::Service::none:
      return false;
    case can::Service::nmt:
    case can::Service::error_control:
    case can::Service::lss:
    case can::Service::sleep:
      return configurable || state == State::stopped;
    case can::Service::rpdo:
    case can::Service::tpdo_rtr:
    case can::Service::srdo:
      return state == State::operational;
    case can::Service::sync:
    case can::Service::time:
    case can::Service::emcy:
    case can::Service::sdo_server:
    case can::Service::sdo_client:
    case can::Service::usdo:
      return configurable;
  }
  return false;
}

}  // namespace linegate::nmt
