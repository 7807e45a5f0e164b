// SPDX-License-Identifier: Apache-2.0
// Names of lines and nodes for shell completion.
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

// `linegate names`: the names of all gateways that are received within context.wait, one on each
// line. Does not report what is missing. Names that plant.yaml does not permit are omitted, because
// a shell may expand them: lines with all of their nodes; of a node only its node-ID remains.
int names(Context& context);

}  // namespace linegate::console
