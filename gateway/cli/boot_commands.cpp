// SPDX-License-Identifier: Apache-2.0
// Commands for the boot process of nodes (CiA 302-2).
#include <memory>
#include <string>

#include "bridges/console/accept.h"
#include "bridges/console/boot.h"
#include "gateway/cli/command_line.h"
#include "gateway/cli/commands.h"

namespace linegate::gateway {

void add_boot(CommandLine& line) {
  const auto name = std::make_shared<std::string>();
  CLI::App* boot = line.app().add_subcommand(
      "boot", "repeat the boot process of the nodes of a line; fails if a node is not booted");
  boot->add_option("line", *name, "LINE, or LINE:NODE for one node")->required();
  line.on(boot, {.events = true, .commands = true},
          [name](console::Context& c) { return console::boot(c, *name); });
}

void add_accept(CommandLine& line) {
  const auto name = std::make_shared<std::string>();
  CLI::App* accept = line.app().add_subcommand(
      "accept", "after a device was replaced: expect the identity of the present one, and boot it");
  accept->add_option("node", *name, "LINE:NODE")->required();
  line.on(accept, {.events = true, .commands = true},
          [name](console::Context& c) { return console::accept(c, *name); });
}

}  // namespace linegate::gateway
