// SPDX-License-Identifier: Apache-2.0
// What subscribers see of the output groups of a line: a property of LineState, idl/README.md.
#pragma once

#include <span>
#include <vector>

#include "gateway/publish/values.h"
#include "stack/line/config.h"

namespace linegate::gateway {

// output-groups: "1 0..5, 2 6..9, +3", the number of the group and a run of its entries; at the end
// how many runs found no room. None if the line has no groups.
std::vector<Property> output_group_properties(std::span<const line::OutputGroup> groups);

}  // namespace linegate::gateway
