// SPDX-License-Identifier: Apache-2.0
#include "stack/diagnosis/global_events.h"

#include <string_view>

#include "stack/base/result.h"
#include "stack/can/bus_state.h"
#include "stack/manager/boot_report.h"

namespace linegate::diagnosis {
namespace {

constexpr std::uint32_t kBusyRefusal = 1;   // line::Refusal::busy, part of the contract
constexpr std::uint32_t kLifeGuarding = 2;  // code of heartbeat_lost that names no node

constexpr std::uint16_t when(bool condition, std::uint16_t bits) {
  return condition ? bits : std::uint16_t{0};
}

// A node that stopped answering during its boot process, or whose identity could not be read, is
// not known to be a wrong device.
bool is_unproved(const Event& event) {
  const manager::BootFinding finding = manager::finding_of(event);
  return finding.kind == manager::BootFinding::Kind::abort &&
         (event.code != 'J' || !manager::is_refusal(finding));
}

std::uint16_t of_boot(char letter, bool mandatory) {
  constexpr std::string_view kIdentity = "CDMNO";
  if (letter == 'J') {
    return when(mandatory, kMandatoryWrongNode) | kConfigurationFailed;
  }
  if (letter != '\0' && kIdentity.find(letter) != std::string_view::npos) {
    return mandatory ? kMandatoryWrongNode : kOptionalWrongNode;
  }
  return 0;
}

bool is_error_state(std::uint32_t state) {
  return state == static_cast<std::uint32_t>(can::BusState::error_warning) ||
         state == static_cast<std::uint32_t>(can::BusState::error_passive);
}

bool is_bus_off(std::uint32_t state) {
  return state == static_cast<std::uint32_t>(can::BusState::bus_off);
}

}  // namespace

std::uint16_t global_events(const Event& event, const EventContext& context) {
  const std::uint16_t disturbed = when(context.scanning, kScanDisturbed);
  switch (event.kind) {
    case EventKind::bus_state:
      return when(is_bus_off(event.code), kCommunicationFailed);
    case EventKind::frames_lost:
      return kCommunicationFailed;
    case EventKind::duplicate_node_id:
      return kOwnNodeIdTaken;
    case EventKind::heartbeat_lost:
      return event.code == kLifeGuarding ? std::uint16_t{0}
                                         : disturbed | when(context.mandatory, kMandatoryLost);
    case EventKind::boot_up:
      return disturbed;
    case EventKind::boot_result:
      return is_unproved(event) ? std::uint16_t{0}
                                : of_boot(static_cast<char>(event.code), context.mandatory);
    case EventKind::configuration_error:
      return event.node == 0 || event.node == context.own_node ? kOwnPdoUnusable
                                                               : kConfigurationFailed;
    case EventKind::pdo_length:
      return when(std::to_integer<std::uint32_t>(event.data[0]) < event.value, kPdoTooShort);
    case EventKind::command_refused:
      return when(event.code == kBusyRefusal, kQueueFull);
    default:
      return 0;
  }
}

void CommunicationState::note(const Event& event) {
  switch (event.kind) {
    case EventKind::frames_lost:
      kept_ |= kControllerOverrun;
      return;
    case EventKind::queue_full:
      kept_ |= kReceiveOverrun;
      return;
    case EventKind::bus_error:
      errors_ = true;
      return;
    case EventKind::bus_state:
      bus_ = static_cast<can::BusState>(event.code);
      if (is_error_state(event.value) && !is_error_state(event.code) && !is_bus_off(event.code)) {
        kept_ |= kErrorStateLeft;
      }
      now_ = is_bus_off(event.code)       ? kBusOff
             : is_error_state(event.code) ? kErrorState
                                          : std::uint8_t{0};
      return;
    default:
      return;
  }
}

}  // namespace linegate::diagnosis
