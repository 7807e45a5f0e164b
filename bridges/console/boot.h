// SPDX-License-Identifier: Apache-2.0
// `linegate boot`: repeats boot processes and prints their results.
#pragma once

#include <string>
#include <vector>

#include "bridges/console/commands.h"
#include "bridges/console/table.h"
#include "stack/manager/state.h"

namespace linegate::console {

// what: a line, or LINE:NODE for one node. Prints each result on context.err as it arrives, and all
// of them at the end, as a table or as JSON. Returns kFailed if a node did not boot.
int boot(Context& context, const std::string& what);

// One row for each node.
Table boot_table(const LineId& id, const std::vector<manager::BootOutcome>& outcomes);
std::string boot_json(const LineId& id, const std::vector<manager::BootOutcome>& outcomes);

}  // namespace linegate::console
