// SPDX-License-Identifier: Apache-2.0
#include "gateway/cli/unknown_command.h"

#include <vector>

#include <CLI/CLI.hpp>

#include "gateway/config/value.h"

namespace linegate::gateway {

std::string unknown_command(const CLI::App& app) {
  const CLI::App* last = &app;
  std::string above;
  while (!last->get_subcommands().empty()) {
    last = last->get_subcommands().back();
    above += last->get_name() + ' ';
  }
  const auto commands = last->get_subcommands([](const CLI::App*) { return true; });
  const std::vector<std::string> words = app.remaining(true);
  if (commands.empty() || words.empty() || words[0].starts_with('-')) {
    return {};
  }
  std::vector<std::string> names;
  for (const CLI::App* command : commands) {
    if (!command->get_group().empty()) {
      names.push_back(command->get_name());
    }
  }
  const std::string guess = config::nearest(words[0], names);
  return "there is no command '" + above + words[0] + "'" +
         (guess.empty() ? "; linegate " + above + "--help lists them"
                        : "; did you mean '" + above + guess + "'?");
}

}  // namespace linegate::gateway
