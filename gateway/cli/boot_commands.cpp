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
      "boot", "check, configure and start the nodes of a line anew; fails if one is not booted");
  boot->add_option("line", *name, "LINE, or LINE:NODE for one node")->required();
  line.on(boot, {.events = true, .commands = true},
          [name](console::Context& c) { return console::boot(c, *name); });
}

void add_accept(CommandLine& line) {
  const auto name = std::make_shared<std::string>();
  CLI::App* accept = line.app().add_subcommand(
      "accept", "expect the device that is there from now on, and boot it: after an exchange");
  accept->add_option("node", *name, "LINE:NODE")->required();
  line.on(accept, {.events = true, .commands = true},
          [name](console::Context& c) { return console::accept(c, *name); });
}

}  // namespace linegate::gateway
