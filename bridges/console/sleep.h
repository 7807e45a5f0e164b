// SPDX-License-Identifier: Apache-2.0
// The command `sleep`.
#pragma once

#include <string>

#include "bridges/console/commands.h"

namespace linegate::console {

// action: check, sleep, now (without a check), wake, object, consent. kFailed if a node objects:
// its node-ID is printed.
int sleep(Context& context, const std::string& line, const std::string& action);

}  // namespace linegate::console
