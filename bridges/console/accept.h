// SPDX-License-Identifier: Apache-2.0
// `linegate accept`: a device that was exchanged becomes the one that is expected.
#pragma once

#include <string>

#include "bridges/console/commands.h"

namespace linegate::console {

// what: LINE:NODE. Reads the identity of the node (1000h, 1018h:1 to 4), writes it to 1F84h to
// 1F88h of the manager, which compares them at each boot until the gateway starts anew, and boots
// the node. Says what plant.yaml needs for the time after that. kFailed if the node is not booted.
int accept(Context& context, const std::string& what);

}  // namespace linegate::console
