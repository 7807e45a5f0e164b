// SPDX-License-Identifier: Apache-2.0
// The finite state automaton of a drive (CiA 402): controlword 6040h in, statusword 6041h out.
#pragma once

#include <cstdint>

namespace linegate::sim {

enum class DriveState : std::uint8_t {
  not_ready_to_switch_on,
  switch_on_disabled,
  ready_to_switch_on,
  switched_on,
  operation_enabled,
  quick_stop_active,
  fault_reaction_active,
  fault,
};

// Commands of the controlword, bits 7, 3, 2, 1, 0.
enum class DriveCommand : std::uint8_t {
  none,
  shutdown,          // 0xxx x110
  switch_on,         // 0xxx 0111
  disable_voltage,   // 0xxx xx0x
  quick_stop,        // 0xxx x01x
  enable_operation,  // 0xxx 1111
  fault_reset,       // bit 7 rises
};

// The command that a controlword gives, compared with the previous controlword. switch_on is also
// the "disable operation" of CiA 402.
DriveCommand drive_command(std::uint16_t controlword, std::uint16_t before);

// The state after a command (transitions 2 to 12, 15, 16); unchanged if there is no such
// transition. enable_operation in ready_to_switch_on passes through switched_on.
DriveState after(DriveState state, DriveCommand command);

// Bits 0 to 6 of the statusword. Bit 4 (voltage enabled) is set in the states that permit power.
std::uint16_t status_bits(DriveState state);

}  // namespace linegate::sim
