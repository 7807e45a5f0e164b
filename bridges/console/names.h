// SPDX-License-Identifier: Apache-2.0
// What a shell completes: the names of lines and nodes.
#pragma once

#include <string>
#include <vector>

#include "bridges/console/commands.h"

namespace linegate::console {

struct NamedNode {
  unsigned id = 0;
  std::string name;  // may be empty
};

// "press", then "press:own", "press:all" and "press:ram" or "press:5" of each node.
std::vector<std::string> completions(const std::string& line, const std::vector<NamedNode>& nodes);

// `linegate names`: those of all gateways, one each line; what is received within context.wait.
// Says nothing of what is missing. Names that no plant.yaml can have are left out, since a shell
// may expand them: lines with all of their nodes; a node is then its node-ID.
int names(Context& context);

}  // namespace linegate::console
