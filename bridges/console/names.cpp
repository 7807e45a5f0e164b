// SPDX-License-Identifier: Apache-2.0
#include "bridges/console/names.h"

#include <algorithm>
#include <ostream>

#include "bridges/console/lookup.h"
#include "bridges/console/model.h"

namespace linegate::console {

std::vector<std::string> completions(const std::string& line, const std::vector<NamedNode>& nodes) {
  std::vector<std::string> out{line, line + ":own", line + ":all"};
  for (const NamedNode& node : nodes) {
    out.push_back(line + ':' + (node.name.empty() ? std::to_string(node.id) : node.name));
  }
  return out;
}

int names(Context& context) {
  Model model;
  (void)wait_until_settled(context, model, [&] {
    return !model.lines().empty() && std::ranges::all_of(model.lines(), [](const auto& one) {
      return one.second.view && knows_nodes(one.second);
    });
  });
  for (const auto& [id, line] : model.lines()) {
    // The output goes to a shell, and any participant of the domain can publish a name such as
    // "$(reboot)".
    if (!is_plain_name(id.line) || !is_plain_name(id.gateway)) {
      continue;
    }
    const bool ambiguous = model.find(id.line).size() > 1;
    std::vector<NamedNode> nodes;
    for (const auto& [number, node] : line.nodes) {
      nodes.push_back({number, is_plain_name(node.name) ? node.name : std::string()});
    }
    for (const std::string& name :
         completions(ambiguous ? id.gateway + '/' + id.line : id.line, nodes)) {
      context.out << name << '\n';
    }
  }
  return kDone;
}

}  // namespace linegate::console
