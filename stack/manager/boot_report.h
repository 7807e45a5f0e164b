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

#include "stack/base/result.h"
#include "stack/manager/state.h"

namespace linegate::manager {

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
