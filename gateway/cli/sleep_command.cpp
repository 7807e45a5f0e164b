// SPDX-License-Identifier: Apache-2.0
#include <memory>
#include <string>

#include "bridges/console/sleep.h"
#include "gateway/cli/command_line.h"
#include "gateway/cli/commands.h"

namespace linegate::gateway {
namespace {

struct SleepArguments {
  std::string line, action = "sleep";
};

}  // namespace

void add_sleep(CommandLine& line) {
  const auto arguments = std::make_shared<SleepArguments>();
  CLI::App* sleep = line.app().add_subcommand(
      "sleep", "let all nodes of a line sleep, unless one objects, or wake them");
  sleep->add_option("line", arguments->line, "LINE")->required();
  sleep->add_option("action", arguments->action,
                    "check, sleep, now, wake, object, consent; default: sleep");
  line.on(sleep, {.commands = true}, [arguments](console::Context& c) {
    return console::sleep(c, arguments->line, arguments->action);
  });
}

}  // namespace linegate::gateway
