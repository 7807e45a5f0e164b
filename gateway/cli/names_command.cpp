// SPDX-License-Identifier: Apache-2.0
#include <iostream>
#include <memory>
#include <string>
#include <vector>

#include "bridges/console/names.h"
#include "gateway/cli/command_line.h"
#include "gateway/cli/commands.h"
#include "gateway/config/plant.h"
#include "gateway/runtime/exit_code.h"

namespace linegate::gateway {
namespace {

// Prints the lines and nodes of a plant.yaml in the format of console::completions(). Prints no
// error messages; returns the exit code.
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

}  // namespace

// For completion by a shell, which must be fast. Hidden from the help.
void add_names(CommandLine& line) {
  const auto plant = std::make_shared<std::string>();
  CLI::App* names =
      line.app().add_subcommand("names", "print names of lines and nodes, for shell completion");
  names->group("");
  names->add_option("--plant", *plant, "names of a plant.yaml instead of running gateways");
  line.on(names, [&line, plant] {
    return plant->empty() ? line.with_client({}, console::names) : print_names(*plant);
  });
}

}  // namespace linegate::gateway
