// SPDX-License-Identifier: Apache-2.0
#include "gateway/cli/plant_names.h"

#include <iostream>
#include <vector>

#include "bridges/console/names.h"
#include "gateway/config/plant.h"
#include "gateway/runtime/exit_code.h"

namespace linegate::gateway {

int print_names(const std::string& path) {
  const auto loaded = config::load(path);
  if (!loaded.value) {
    return kExitUsage;
  }
  for (const config::LinePlan& line : loaded.value->lines) {
    std::vector<console::NamedNode> nodes;
    for (const auto& node : line.config.nodes) {
      nodes.push_back({node.id, node.name});
    }
    for (const auto& device : line.config.devices) {
      nodes.push_back({device.id, device.name});
    }
    for (const std::string& name : console::completions(line.config.name, nodes)) {
      std::cout << name << '\n';
    }
  }
  return kExitOk;
}

}  // namespace linegate::gateway
