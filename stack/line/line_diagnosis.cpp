// What the diagnosis of a line is told of it.
#include "stack/line/build.h"
#include "stack/line/line_impl.h"

namespace linegate::line {

diagnosis::Options diagnosis_options(const LineConfig& config) {
  diagnosis::Options out{.own_node = config.node_id};
  for (const NodeConfig& node : config.nodes) {
    out.assigned.set(node.id);
    out.mandatory.set(node.id, node.mandatory);
  }
  return out;
}

diagnosis::NetworkFacts Line::Impl::network() const {
  return {.running = running,
          .manages = manages(),
          .own = node.state(),
          .manager = manager.state(),
          .starts_nodes = config.start_nodes,
          .scanning = scan_of_all && scanner.active()};
}

const NodeState& Line::Impl::node_seen(std::uint8_t id) const {
  return manager.node(id);
}

}  // namespace linegate::line
