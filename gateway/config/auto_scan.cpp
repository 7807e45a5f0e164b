// SPDX-License-Identifier: Apache-2.0
// `auto:` of a line: its nodes are determined by a scan.
#include <filesystem>
#include <system_error>

#include "gateway/config/sections.h"

namespace linegate::config {
namespace {

using std::chrono::milliseconds;

void read_folder(Section& section, std::string& folder) {
  const YAML::Node node = section.find("eds");
  const auto text = section.text(node);
  if (!text) {
    return;
  }
  const auto path =
      (std::filesystem::path(section.findings().file()).parent_path() / *text).lexically_normal();
  std::error_code ignored;
  if (!std::filesystem::is_directory(path, ignored)) {
    section.findings().error(place_of(node), "there is no folder " + path.string());
  }
  folder = path.string();
}

}  // namespace

void read_auto(Section& section, LinePlan& plan) {
  const YAML::Node node = section.find("auto");
  if (!node.IsDefined()) {
    return;
  }
  bool wanted = true;
  AutoScan scan;
  if (node.IsMap()) {
    Section from(section.findings(), node, "auto");
    from.read("at_start", scan.at_start);
    from.read("set_up", scan.set_up);
    from.read_multiple("heartbeat", plan.config.found_heartbeat, milliseconds(1),
                       milliseconds(65'535));
    read_folder(from, scan.eds);
    from.done();
  } else {
    section.read("auto", wanted);
  }
  if (!wanted) {
    return;
  }
  if (plan.config.role != line::Role::manager || !plan.config.nodes.empty()) {
    section.findings().error(place_of(node),
                             "auto is for a line in the role manager without nodes: a scan finds "
                             "them");
  }
  plan.auto_scan = std::move(scan);
}

}  // namespace linegate::config
