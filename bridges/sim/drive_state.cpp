// SPDX-License-Identifier: Apache-2.0
#include "bridges/sim/drive_state.h"

#include <array>

namespace linegate::sim {
namespace {

struct Transition {
  DriveState from;
  DriveCommand command;
  DriveState to;
};

using enum DriveState;

// The comments are the transition numbers of CiA 402.
constexpr std::array<Transition, 16> kTransitions{{
    {switch_on_disabled, DriveCommand::shutdown, ready_to_switch_on},         // 2
    {ready_to_switch_on, DriveCommand::switch_on, switched_on},               // 3
    {ready_to_switch_on, DriveCommand::enable_operation, operation_enabled},  // 3 and 4
    {switched_on, DriveCommand::enable_operation, operation_enabled},         // 4
    {operation_enabled, DriveCommand::switch_on, switched_on},                // 5
    {switched_on, DriveCommand::shutdown, ready_to_switch_on},                // 6
    {ready_to_switch_on, DriveCommand::disable_voltage, switch_on_disabled},  // 7
    {ready_to_switch_on, DriveCommand::quick_stop, switch_on_disabled},       // 7
    {operation_enabled, DriveCommand::shutdown, ready_to_switch_on},          // 8
    {operation_enabled, DriveCommand::disable_voltage, switch_on_disabled},   // 9
    {switched_on, DriveCommand::disable_voltage, switch_on_disabled},         // 10
    {switched_on, DriveCommand::quick_stop, switch_on_disabled},              // 10
    {operation_enabled, DriveCommand::quick_stop, quick_stop_active},         // 11
    {quick_stop_active, DriveCommand::disable_voltage, switch_on_disabled},   // 12
    {fault, DriveCommand::fault_reset, switch_on_disabled},                   // 15
    {quick_stop_active, DriveCommand::enable_operation, operation_enabled},   // 16
}};

constexpr std::uint16_t kFaultReset = 0x80;

}  // namespace

DriveCommand drive_command(std::uint16_t controlword, std::uint16_t before) {
  if ((controlword & kFaultReset) != 0) {
    return (before & kFaultReset) == 0 ? DriveCommand::fault_reset : DriveCommand::none;
  }
  if ((controlword & 0x02U) == 0) {
    return DriveCommand::disable_voltage;
  }
  if ((controlword & 0x04U) == 0) {
    return DriveCommand::quick_stop;
  }
  if ((controlword & 0x01U) == 0) {
    return DriveCommand::shutdown;
  }
  return (controlword & 0x08U) != 0 ? DriveCommand::enable_operation : DriveCommand::switch_on;
}

DriveState after(DriveState state, DriveCommand command) {
  for (const Transition& transition : kTransitions) {
    if (transition.from == state && transition.command == command) {
      return transition.to;
    }
  }
  return state;
}

std::uint16_t status_bits(DriveState state) {
  switch (state) {
    case not_ready_to_switch_on:
      return 0x00;
    case switch_on_disabled:
      return 0x40;
    case ready_to_switch_on:
      return 0x31;
    case switched_on:
      return 0x33;
    case operation_enabled:
      return 0x37;
    case quick_stop_active:
      return 0x17;
    case fault_reaction_active:
      return 0x1F;
    case fault:
      return 0x08;
  }
  return 0;
}

}  // namespace linegate::sim
