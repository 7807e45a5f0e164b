// SPDX-License-Identifier: Apache-2.0
// Makes a line once while the configuration is read, so that its diagnostics are reported in the
// document.
#include <algorithm>
#include <string>
#include <utility>

#include "gateway/config/sections.h"
#include "stack/line/line.h"

namespace linegate::config {
namespace {

// The diagnostics of a line name a device file, which several nodes may share. So each node gets a
// file name of its own while the line is made.
std::string name_of_file(const line::NodeConfig& node) {
  return "device file of node " + std::to_string(node.id);
}

void put_in_place(const LineSection& section, const std::string& document, Diagnostic& finding) {
  const auto& nodes = section.plan.config.nodes;
  const auto node = std::ranges::find(nodes, finding.file, name_of_file);
  if (node == nodes.end()) {
    return;
  }
  finding.file = node->device.file;
  const auto place = std::ranges::find(section.node_places, node->id, &NodePlace::node);
  if (finding.line != 0 || place == section.node_places.end()) {
    return;  // it has a position in the device file
  }
  finding.text += " (" + finding.file + ")";
  finding.file = document;
  finding.line = place->place.line;
  finding.column = place->place.column;
}

}  // namespace

std::unique_ptr<line::Line> make_line(Findings& findings, const LineSection& section) {
  line::LineConfig config = section.plan.config;
  for (line::NodeConfig& node : config.nodes) {
    node.device.file = name_of_file(node);
  }
  auto made = line::Line::make(std::move(config));
  for (Diagnostic& finding : made.diagnostics) {
    put_in_place(section, findings.file(), finding);
  }
  findings.add(std::move(made.diagnostics));
  return made.value ? *std::move(made.value) : nullptr;
}

}  // namespace linegate::config
