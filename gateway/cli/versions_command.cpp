// SPDX-License-Identifier: Apache-2.0
#include <memory>
#include <string>

#include "gateway/cli/command_line.h"
#include "gateway/cli/commands.h"

namespace linegate::gateway {

void add_versions(CommandLine& line) {
  const auto name = std::make_shared<std::string>();
  CLI::App* versions = line.app().add_subcommand(
      "versions", "print the versions of a running gateway and its libraries");
  versions->add_option("line", *name);
  line.on(versions, {.commands = true},
          [name](console::Context& c) { return console::versions(c, *name); });
}

}  // namespace linegate::gateway
