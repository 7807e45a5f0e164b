// SPDX-License-Identifier: Apache-2.0
// Requests PDOs by remote frame, and writes values by MPDO.
#pragma once

#include <string>
#include <vector>

#include "bridges/console/commands.h"

namespace linegate::console {

// what: "LINE:NODE:tpdo3" for a TPDO of that node, or "LINE:own:rpdo5" for an RPDO of the own node.
// Prints nothing on success.
int pdo_request(Context& context, const std::string& what);

// Writes by MPDO in destination address mode. node: "LINE:NODE", or "LINE:all". words: object, data
// type and value, as for sdo write. Prints the number of the TPDO that sends it.
int mpdo_write(Context& context, const std::string& node, const std::vector<std::string>& words);

}  // namespace linegate::console
