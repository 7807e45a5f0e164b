// SPDX-License-Identifier: Apache-2.0
#include "stack/diagnosis/global_events.h"

#include <string_view>

#include "stack/base/result.h"
#include "stack/can/bus_state.h"
#include "stack/manager/boot_event.h"

namespace linegate::diagnosis {
namespace {

constexpr line::Refusal kBusyRefusal{1};  // line::Refusal::busy, part of the contract

constexpr std::uint16_t when(bool condition, std::uint16_t bits) {
  return condition ? bits : std::uint16_t{0};
}

// A node that stopped answering during its boot process, or whose identity could not be read, is
// not known to be a wrong device.
bool is_unproved(const event::BootResult& result) {
  const manager::BootFinding finding = manager::finding_of(result);
  return finding.kind == manager::BootFinding::Kind::abort &&
         (result.letter != 'J' || !manager::is_refusal(finding));
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

bool is_error_state(can::BusState state) {
  return state == can::BusState::error_warning || state == can::BusState::error_passive;
}

}  // namespace

std::uint16_t global_events(const Event& event, const EventContext& context) {
  const std::uint16_t disturbed = when(context.scanning, kScanDisturbed);
  if (const auto* const bus = event.get<event::BusState>()) {
    return when(bus->state == can::BusState::bus_off, kCommunicationFailed);
  }
  if (const auto* const lost = event.get<event::HeartbeatLost>()) {
    return lost->by == event::ErrorControl::life_guarding
               ? std::uint16_t{0}
               : disturbed | when(context.mandatory, kMandatoryLost);
  }
  if (const auto* const result = event.get<event::BootResult>()) {
    return is_unproved(*result) ? std::uint16_t{0} : of_boot(result->letter, context.mandatory);
  }
  if (const auto* const wrong = event.get<event::PdoLength>()) {
    return when(wrong->received < wrong->mapped, kPdoTooShort);
  }
  if (const auto* const refused = event.get<event::CommandRefused>()) {
    return when(refused->refusal == kBusyRefusal, kQueueFull);
  }
  switch (event.kind()) {
    case EventKind::frames_lost:
      return kCommunicationFailed;
    case EventKind::duplicate_node_id:
      return kOwnNodeIdTaken;
    case EventKind::boot_up:
      return disturbed;
    case EventKind::configuration_error:
      return event.node == 0 || event.node == context.own_node ? kOwnPdoUnusable
                                                               : kConfigurationFailed;
    default:
      return 0;
  }
}

void CommunicationState::note(const Event& event) {
  if (const auto* const bus = event.get<event::BusState>()) {
    note(*bus);
    return;
  }
  switch (event.kind()) {
    case EventKind::frames_lost:
      kept_ |= kControllerOverrun;
      return;
    case EventKind::queue_full:
      kept_ |= kReceiveOverrun;
      return;
    case EventKind::bus_error:
      errors_ = true;
      return;
    default:
      return;
  }
}

void CommunicationState::note(const event::BusState& change) {
  const bool is_off = change.state == can::BusState::bus_off;
  const bool is_error = is_error_state(change.state);
  bus_ = change.state;
  if (is_error_state(change.before) && !is_error && !is_off) {
    kept_ |= kErrorStateLeft;
  }
  now_ = is_off ? kBusOff : is_error ? kErrorState : std::uint8_t{0};
}

}  // namespace linegate::diagnosis
