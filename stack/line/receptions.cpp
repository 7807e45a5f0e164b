// SPDX-License-Identifier: Apache-2.0
// Receptions of PDOs that have a queue.
#include <algorithm>

#include "stack/line/build.h"
#include "stack/line/node_line.h"
#include "stack/line/observer_line.h"
#include "stack/pdo/reception.h"

namespace linegate::line {

std::size_t longest_pdo(const LineConfig& config) {
  return 8 * (config.canopen_fd ? can::kMaxFdData : can::kMaxClassicData);
}

std::uint32_t queue_of(const LineConfig& config, std::uint8_t node, std::uint16_t tpdo) {
  const auto found = std::ranges::find(config.nodes, node, &NodeConfig::id);
  if (found != config.nodes.end()) {
    if (const auto own = found->tpdo_queue.find(tpdo); own != found->tpdo_queue.end()) {
      return own->second;
    }
  }
  return config.pdo_queue;
}

std::uint32_t longest_queue(const LineConfig& config) {
  std::uint32_t longest = config.pdo_queue;
  for (const NodeConfig& node : config.nodes) {
    for (const auto& [number, length] : node.tpdo_queue) {
      longest = std::max(longest, length);
    }
  }
  return longest;
}

void set_queues(const LineConfig& config, pdo::LinkPlan& plan) {
  for (pdo::LinkedPdo& pdo : plan.rpdos) {
    // PdoReception has no validity
    pdo.queue = pdo.is_srdo() ? 0 : queue_of(config, pdo.node, pdo.remote_pdo);
  }
}

bool NodeLine::pop_reception(pdo::Reception& out) {
  return node_.pdos().pop_reception(out);
}

bool ObserverLine::pop_reception(pdo::Reception& out) {
  return inputs->engine.pop_reception(out);
}

}  // namespace linegate::line
