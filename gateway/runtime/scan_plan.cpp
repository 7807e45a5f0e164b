// SPDX-License-Identifier: Apache-2.0
#include "gateway/runtime/scan_plan.h"

#include <algorithm>
#include <utility>

#include "gateway/config/found_nodes.h"
#include "stack/line/pdo_checks.h"

namespace linegate::gateway {
namespace {

using scan::ScannedNode;

template <class Node>
auto find(std::vector<Node>& nodes, std::uint8_t id) {
  return std::ranges::find(nodes, id, &Node::id);
}

// Replaces the scan results of these nodes. A node that was not read completely keeps its earlier
// result.
std::vector<ScannedNode> known_after(std::vector<ScannedNode> before,
                                     std::vector<ScannedNode> fresh, bool all) {
  std::vector<ScannedNode> out = all ? std::vector<ScannedNode>{} : before;
  for (ScannedNode& node : fresh) {
    const auto old = find(before, node.id);
    if (node.end != AbortCode::none && old != before.end()) {
      node = *old;
    }
    std::erase_if(out, [&](const ScannedNode& other) { return other.id == node.id; });
    out.push_back(std::move(node));
  }
  std::ranges::sort(out, {}, &ScannedNode::id);
  return out;
}

// The node keeps its present configuration: nothing is written to it.
void leave_alone(line::NodeConfig& node) {
  node.as_found = true;
  node.heartbeat_consumer = std::exchange(node.heartbeat, Duration{}) * 5 / 2;
  node.objects.clear();
}

}  // namespace

Loaded<config::LinePlan> plan_of(const config::LinePlan& present, const AppliedScan& scan) {
  Loaded<config::LinePlan> out;
  const auto report = [&](Severity severity, std::string text) {
    out.diagnostics.push_back({severity, present.config.name, 0, 0, std::move(text)});
  };
  if (scan.nodes.empty()) {
    report(Severity::warning, "a scan found nothing that could be taken over");
    return out;
  }
  const bool all = scan.request.node == 0;
  config::LinePlan plan = present;
  plan.config.scanned = known_after(present.config.scanned, scan.nodes, all);
  config::FoundNodes found = config::found_nodes(
      plan.config.scanned, present.auto_scan ? present.auto_scan->eds : std::string{},
      line::longest_pdo(plan.config));
  if (!found.error.empty()) {
    report(Severity::error, found.error);
    return out;
  }
  for (std::string& note : found.notes) {
    report(Severity::note, std::move(note));
  }
  plan.config.nodes.clear();
  for (config::FoundNode& node : found.nodes) {
    const auto before =
        std::ranges::find(present.config.nodes, node.config.id, &line::NodeConfig::id);
    const bool was_set_up = before != present.config.nodes.end() && !before->as_found;
    const bool is_fresh = all || node.config.id == scan.request.node;
    if (is_fresh ? !scan.request.set_up : !was_set_up) {
      leave_alone(node.config);
    }
    plan.config.nodes.push_back(std::move(node.config));
  }
  report(Severity::note, "a scan is taken over: " + std::to_string(plan.config.nodes.size()) +
                             (plan.config.nodes.size() == 1 ? " node" : " nodes"));
  if (auto waiting = line::unsynchronised_pdos(plan.config)) {
    report(Severity::warning, std::move(waiting->text));
  }
  out.value = std::move(plan);
  return out;
}

}  // namespace linegate::gateway
