// SPDX-License-Identifier: Apache-2.0
#include <memory>
#include <string>

#include "gateway/cli/command_line.h"
#include "gateway/cli/commands.h"

namespace linegate::gateway {
namespace {

struct NmtArguments {
  std::string command, node;
};

}  // namespace

void add_nmt(CommandLine& line) {
  const auto arguments = std::make_shared<NmtArguments>();
  CLI::App* nmt = line.app().add_subcommand("nmt", "send an NMT command");
  nmt->add_option("command", arguments->command,
                  "start, stop, pre-operational, reset-node, reset-communication")
      ->required();
  nmt->add_option("node", arguments->node, "LINE:NODE or LINE:all")->required();
  line.on(nmt, {.commands = true}, [arguments](console::Context& c) {
    return console::nmt(c, arguments->command, arguments->node);
  });
}

}  // namespace linegate::gateway
