// SPDX-License-Identifier: Apache-2.0
// Commands for the states of gateways, their lines and nodes.
#include <memory>
#include <string>

#include "gateway/cli/command_line.h"
#include "gateway/cli/commands.h"

namespace linegate::gateway {

void add_gateways(CommandLine& line) {
  CLI::App* gateways = line.app().add_subcommand(
      "gateways", "print version, reloads and DDS counters of the gateways");
  line.on(gateways, {}, console::gateways);
}

void add_lines(CommandLine& line) {
  CLI::App* lines =
      line.app().add_subcommand("lines", "print the lines of all gateways and their state");
  line.on(lines, {}, console::lines);
}

void add_nodes(CommandLine& line) {
  const auto name = std::make_shared<std::string>();
  CLI::App* nodes =
      line.app().add_subcommand("nodes", "print the nodes of a line, or of all lines");
  nodes->add_option("line", *name);
  line.on(nodes, {}, [name](console::Context& c) { return console::nodes(c, *name); });
}

}  // namespace linegate::gateway
