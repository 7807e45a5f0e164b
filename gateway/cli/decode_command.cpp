// SPDX-License-Identifier: Apache-2.0
#include <memory>

#include "gateway/cli/command_line.h"
#include "gateway/cli/commands.h"
#include "gateway/cli/problems_as_json.h"
#include "gateway/tools/decode.h"

namespace linegate::gateway {

void add_decode(CommandLine& line) {
  const auto options = std::make_shared<DecodeOptions>();
  CLI::App* command = line.app().add_subcommand("decode", "explain a candump log line by line");
  command
      ->add_option("log", options->file,
                   "log of candump -L or linegate record; - reads the standard input, live")
      ->required();
  command->add_option("--plant", options->plant,
                      "use the names, objects and PDOs of the devices of this plant.yaml");
  command->add_option("--line", options->line,
                      "line of the plant; default: the line on the interface that the log names");
  line.on(command, [&line, options] {
    options->json = line.common().json;
    return with_problems_as_json(options->json, [&] { return decode(*options); });
  });
}

}  // namespace linegate::gateway
