// SPDX-License-Identifier: Apache-2.0
// `linegate boot`: boot processes made anew, and how they ended.
#pragma once

#include <string>
#include <vector>

#include "bridges/console/commands.h"
#include "bridges/console/table.h"
#include "stack/manager/boot_report.h"

namespace linegate::console {

// what: a line, or LINE:NODE for one node alone. Tells each result on context.err as it comes, and
// prints them all at the end: as a table, or as JSON. kFailed if a node is not booted.
int boot(Context& context, const std::string& what);

// A row for each node.
Table boot_table(const LineId& id, const std::vector<manager::BootOutcome>& outcomes);
std::string boot_json(const LineId& id, const std::vector<manager::BootOutcome>& outcomes);

}  // namespace linegate::console
