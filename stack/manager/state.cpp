#include "stack/manager/state.h"

namespace linegate::manager {

std::string_view name(ManagerState state) {
  switch (state) {
    case ManagerState::inactive:
      return "inactive";
    case ManagerState::resetting:
      return "resetting";
    case ManagerState::booting:
      return "booting";
    case ManagerState::missing_mandatory:
      return "missing-mandatory";
    case ManagerState::running:
      return "running";
    case ManagerState::stopped:
      return "stopped";
  }
  return "unknown";
}

std::string_view name(Presence presence) {
  switch (presence) {
    case Presence::unknown:
      return "unknown";
    case Presence::present:
      return "present";
    case Presence::missing:
      return "missing";
  }
  return "unknown";
}

std::string_view describe_boot(char letter) {
  switch (letter) {
    case kBooted:
      return "booted";
    case kBootUnfinished:
      return "not finished";
    case 'A':
      return "node is not listed";
    case 'B':
      return "no answer to the SDO upload of 1000h";
    case 'C':
      return "device type differs from the expected one";
    case 'D':
      return "vendor-ID differs from the expected one";
    case 'E':
      return "no heartbeat while the node was to be kept alive";
    case 'F':
      return "no answer to node guarding while the node was to be kept alive";
    case 'G':
      return "no expected software version is configured";
    case 'H':
      return "software version differs and an update is not allowed";
    case 'I':
      return "software update failed";
    case 'J':
      return "configuration failed";
    case 'K':
      return "no heartbeat after the node was configured";
    case 'L':
      return "node was already operational";
    case 'M':
      return "product code differs from the expected one";
    case 'N':
      return "revision number differs from the expected one";
    case 'O':
      return "serial number differs from the expected one";
    default:
      return "unknown boot status";
  }
}

}  // namespace linegate::manager
