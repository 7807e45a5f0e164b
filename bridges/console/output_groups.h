// SPDX-License-Identifier: Apache-2.0
// Which group of outputs an entry is in, as the line's property `output-groups` has it
// (idl/README.md).
#pragma once

#include <cstdint>
#include <string>

#include "bridges/console/client.h"

namespace linegate::console {

struct EntryGroup {
  enum class Found : std::uint8_t {
    group,     // number is that of the group
    none,      // the line has groups, and the entry is in none of them
    left_out,  // the property had no room for all: not known
  };
  Found found = Found::group;
  std::uint16_t number = 0;
};

// Group 0 with all outputs if the line has no groups.
EntryGroup group_of_entry(const LineView& line, std::uint32_t entry);

}  // namespace linegate::console
