// SPDX-License-Identifier: Apache-2.0
// The results of boot processes: the reply to the command `boot`.
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

// The result of a boot slave process, as event::BootResult.
Event boot_result(std::uint8_t node, char letter, const BootFinding& finding, Instant now);

// The finding in an event of boot_result().
BootFinding finding_of(const event::BootResult& result);

// The abort code is 0503 0000h or 0504 0000h to 0504 0004h, with which either side reports that the
// transfer went out of step. It is not a refusal: a repeated transfer may succeed.
bool is_communication_error(AbortCode abort);

// The node refused a transfer that the boot process needs. A node that stopped answering did not
// refuse; one that reported a communication error did only if it repeated it (kRefusals in
// boot_slave.cpp).
bool is_refusal(const BootFinding& finding);

struct BootOutcome {
  std::uint8_t node = 0;
  char letter = kBooted;
  BootFinding finding{};

  friend bool operator==(const BootOutcome&, const BootOutcome&) = default;
};

std::vector<std::byte> write_boot_report(std::span<const BootOutcome> outcomes);
// length_mismatch if the number of bytes is not a multiple of 18.
Result<std::vector<BootOutcome>> read_boot_report(std::span<const std::byte> data);

}  // namespace linegate::manager
