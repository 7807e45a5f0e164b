// SPDX-License-Identifier: Apache-2.0
// PDOs that are asked for with a remote frame, and values that go by MPDO.
#pragma once

#include <string>
#include <vector>

#include "bridges/console/commands.h"

namespace linegate::console {

// what: "LINE:NODE:tpdo3", a TPDO of that node, or "LINE:own:rpdo5", by the number that it has as
// an RPDO of the own node. Prints nothing when it came.
int pdo_request(Context& context, const std::string& what);

// By MPDO in destination address mode. node: "LINE:NODE", or "LINE:all". words: object, data type
// and value, as sdo write takes them. Prints the number of the TPDO that sends it.
int mpdo_write(Context& context, const std::string& node, const std::vector<std::string>& words);

}  // namespace linegate::console
