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
  CLI::App* command = line.app().add_subcommand(
      "check", "print the lines that a plant.yaml configures, or its errors");
  command->add_option("plant", arguments->plant)->required();
  command->add_option(
      "--against", arguments->running,
      "the running plant.yaml: print which lines a reload changes, starts and stops");
  line.on(command, [&line, arguments] {
    const bool json = line.common().json;
    return arguments->running.empty() ? check(arguments->plant, json)
                                      : check_reload(arguments->running, arguments->plant, json);
  });
}

}  // namespace linegate::gateway
