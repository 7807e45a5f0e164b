// SPDX-License-Identifier: Apache-2.0
// The command for SDO connections between nodes (CiA 302-5).
#include <memory>
#include <string>
#include <vector>

#include "bridges/console/connections.h"
#include "gateway/cli/command_line.h"
#include "gateway/cli/commands.h"

namespace linegate::gateway {
namespace {

struct ConnectionArguments {
  std::string line;
  std::vector<std::string> words;
};

}  // namespace

void add_connections(CommandLine& line) {
  const auto arguments = std::make_shared<ConnectionArguments>();
  CLI::App* connections = line.app().add_subcommand(
      "connections", "print, open and close SDO connections between two nodes of a line");
  connections->add_option("line", arguments->line)->required();
  connections->add_option("action", arguments->words, "open CLIENT SERVER, or close NUMBER")
      ->expected(0, 3);
  line.on(connections, {.commands = true}, [arguments](console::Context& c) {
    return console::connections(c, arguments->line, arguments->words);
  });
}

}  // namespace linegate::gateway
