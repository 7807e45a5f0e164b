// SPDX-License-Identifier: Apache-2.0
// `linegate accept`: makes a replaced device the expected one.
#pragma once

#include <string>

#include "bridges/console/commands.h"

namespace linegate::console {

// what: LINE:NODE. Reads the identity of the node (1000h, 1018h:1 to 4), writes it to 1F84h to
// 1F88h of the manager, which compares them at each boot until the gateway restarts, and boots the
// node. Prints the lines that plant.yaml needs to keep it. Returns kFailed if the boot fails.
int accept(Context& context, const std::string& what);

}  // namespace linegate::console
