// SPDX-License-Identifier: Apache-2.0
// The group of an output entry, from the line's property `output-groups` (idl/README.md).
#pragma once

#include <cstdint>
#include <string>

#include "bridges/console/client.h"

namespace linegate::console {

struct EntryGroup {
  enum class Found : std::uint8_t {
    group,     // `number` is valid
    none,      // the line has groups, but none contains the entry
    left_out,  // unknown: the property had no room for all groups
  };
  Found found = Found::group;
  std::uint16_t number = 0;
};

// A line without groups has group 0 with all outputs.
EntryGroup group_of_entry(const LineView& line, std::uint32_t entry);

}  // namespace linegate::console
