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
// Says nothing of what is missing.
int names(Context& context);

}  // namespace linegate::console
