// SPDX-License-Identifier: Apache-2.0
// The output groups of a line for subscribers: a property of LineState, idl/README.md.
#pragma once

#include <span>
#include <vector>

#include "gateway/publish/values.h"
#include "stack/line/config.h"

namespace linegate::gateway {

// output-groups: "1 0..5, 2 6..9, +3": the number of a group and a range of its entries, and at the
// end the number of omitted ranges. Empty if the line has no groups.
std::vector<Property> output_group_properties(std::span<const line::OutputGroup> groups);

}  // namespace linegate::gateway
