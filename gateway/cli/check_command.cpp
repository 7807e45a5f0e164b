// SPDX-License-Identifier: Apache-2.0
#include <memory>
#include <string>

#include "gateway/cli/command_line.h"
#include "gateway/cli/commands.h"
#include "gateway/tools/check.h"
#include "gateway/tools/check_reload.h"

namespace linegate::gateway {
namespace {

struct CheckArguments {
  std::string plant, running;
};

}  // namespace

void add_check(CommandLine& line) {
  const auto arguments = std::make_shared<CheckArguments>();
  CLI::App* command =
      line.app().add_subcommand("check", "what a plant.yaml would run, and what is wrong");
  command->add_option("plant", arguments->plant)->required();
  command->add_option("--against", arguments->running,
                      "the plant.yaml that runs: what a reload would change, start and stop");
  line.on(command, [&line, arguments] {
    const bool json = line.common().json;
    return arguments->running.empty() ? check(arguments->plant, json)
                                      : check_reload(arguments->running, arguments->plant, json);
  });
}

}  // namespace linegate::gateway
