// SPDX-License-Identifier: Apache-2.0
// `linegate monitor --node`: resolves the node.
#include <algorithm>
#include <iterator>
#include <ostream>

#include "bridges/console/discovery.h"
#include "bridges/console/lookup.h"
#include "bridges/console/monitor.h"
#include "bridges/console/table.h"

namespace linegate::console {
namespace {

// The name that Model::find() resolves to this line alone.
std::string line_name(const Model& model, const Line& line) {
  return model.find(line.id.line).size() == 1 ? line.id.line : line.id.gateway + '/' + line.id.line;
}

// "press:ram", or with its node-ID: "press:ram (5)".
std::string with_line(const Model& model, const Line& line, const NodeView& node, bool number) {
  return printable(line_name(model, line)) + ':' + printable(node.name) +
         (number ? " (" + std::to_string(node.state.node) + ')' : "");
}

struct NamedOnLine {
  const Line* line = nullptr;
  const NodeView* node = nullptr;
};

std::vector<NamedOnLine> nodes_with_names(const Model& model) {
  std::vector<NamedOnLine> out;
  for (const auto& [id, line] : model.lines()) {
    for (const auto& [number, node] : line.nodes) {
      if (!line.gone && !node.name.empty()) {
        out.push_back({&line, &node});
      }
    }
  }
  return out;
}

std::string list_of_nodes(const Model& model, const std::vector<NamedOnLine>& nodes, bool numbers) {
  std::string out;
  for (const NamedOnLine& one : nodes) {
    out += (out.empty() ? "" : ", ") + with_line(model, *one.line, *one.node, numbers);
  }
  return out;
}

// Sets the filter to the only node with that name on any line; otherwise reports on context.err
// that there are none or several.
int find_on_any_line(Context& context, Model& model, const std::string& name, Filter& filter) {
  const bool settled = wait_until_settled(context, model, [&] {
    return std::ranges::all_of(model.lines(), [](const auto& line) {
      return line.second.gone || (line.second.view && knows_nodes(line.second));
    });
  });
  const std::vector<NamedOnLine> all = nodes_with_names(model);
  std::vector<NamedOnLine> meant;
  std::ranges::copy_if(all, std::back_inserter(meant),
                       [&](const NamedOnLine& one) { return one.node->name == name; });
  const std::string unsettled = unsettled_text(context, model);
  if (model.lines().empty()) {
    context.err << no_line_text(context, model, "") << '\n';
  } else if (meant.empty()) {
    context.err << "no node '" << printable(name) << "' on any line; there are: "
                << (all.empty() ? "none with a name" : list_of_nodes(model, all, true))
                << (unsettled.empty() ? "" : "; " + unsettled) << '\n';
  } else if (meant.size() > 1) {
    context.err << "more than one node is called '" << printable(name)
                << "': " << list_of_nodes(model, meant, false) << "; name its line with --line\n";
  } else if (!settled) {
    context.err << "'" << printable(name) << "' may be ambiguous: "
                << (unsettled.empty() ? "not all nodes were received" : unsettled)
                << "; name its line with --line, or use a longer --wait\n";
  } else {
    filter.line = line_name(model, *meant.front().line);
    filter.node = meant.front().node->state.node;
    return kDone;
  }
  return kFailed;
}

}  // namespace

int find_node(Context& context, Model& model, const std::string& text, Filter& filter) {
  if (text.empty()) {
    return kDone;
  }
  auto node = parse_node(':' + text);
  if (!node || node->own || node->all) {
    context.err << "'" << printable(text) << "' is not a node: a node-ID 1..127, or a name\n";
    return kUsage;
  }
  if (!node->name.empty() && filter.line.empty()) {
    return find_on_any_line(context, model, node->name, filter);
  }
  if (!node->name.empty()) {
    const Line* const line = find_line(context, model, filter.line);
    if (line == nullptr || !resolve_node(context, model, *line, *node)) {
      return kFailed;
    }
  }
  filter.node = node->node;
  return kDone;
}

}  // namespace linegate::console
