// SPDX-License-Identifier: Apache-2.0
// How the boot processes of nodes ended: what the command `boot` is answered with.
//
// For each node, ascending, 18 bytes, little-endian: node-ID (1), letter or 0 (1), index (2) and
// sub-index (1) of the object, BootFinding::Kind (1), SDO abort code (4), expected value (4), found
// value (4).
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "stack/base/event.h"
#include "stack/base/result.h"
#include "stack/manager/state.h"

namespace linegate::manager {

// EventKind::boot_result: how a boot slave process ended, as an event.
//
//   code   0 = booted, else the letter
//   value  SDO abort code, or the value that was found
//   data   if something was found: index (2, LE) and sub-index of the object, BootFinding::Kind,
//          expected value (4, LE); of an abort of the protocol that the node said until it counted
//          as a refusal, how often it did
Event boot_result(std::uint8_t node, char letter, const BootFinding& finding, Instant now);

// What boot_result() put into it.
BootFinding finding_of(const Event& event);

// The abort code is one of those with which either side says that it lost the thread of a transfer
// (0503 0000h, 0504 0000h to 0504 0004h): the node refused nothing, and may not once it is asked
// again.
bool is_communication_error(AbortCode abort);

// The node refused what the boot process needs. Not so if it fell silent, or lost the thread of a
// transfer and did not say so again and again.
bool is_refusal(const BootFinding& finding);

struct BootOutcome {
  std::uint8_t node = 0;
  char letter = kBooted;
  BootFinding finding{};

  friend bool operator==(const BootOutcome&, const BootOutcome&) = default;
};

std::vector<std::byte> write_boot_report(std::span<const BootOutcome> outcomes);
// length_mismatch if the bytes are no whole number of nodes.
Result<std::vector<BootOutcome>> read_boot_report(std::span<const std::byte> data);

}  // namespace linegate::manager
