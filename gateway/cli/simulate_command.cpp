// SPDX-License-Identifier: Apache-2.0
#include <memory>

#include "gateway/cli/command_line.h"
#include "gateway/cli/commands.h"
#include "gateway/cli/problems_as_json.h"
#include "gateway/runtime/signals.h"
#include "gateway/tools/simulate.h"

namespace linegate::gateway {

void add_simulate(CommandLine& line) {
  const auto options = std::make_shared<SimulateOptions>();
  CLI::App* command =
      line.app().add_subcommand("simulate", "run simulated devices on an interface");
  command->add_option("interface", options->uri, "e.g. socketcan:vcan0");
  command->add_option(
      "--device", options->devices,
      "PROFILE:NODE, e.g. drive:5; drive:5:unconfigured is without a node-ID until LSS "
      "gives it one; repeatable");
  command->add_option("--plant", options->plant, "simulate all nodes of a line of this plant.yaml");
  command->add_option("--line", options->line, "line of the plant");
  command->add_option("--store", options->storage,
                      "folder for parameters stored by 1010h, one file a device");
  line.on(command, [&line, options] {
    block_stop_signals();
    limit_end(kEndLimit);
    return with_problems_as_json(line.common().json, [&] { return simulate(*options); });
  });
}

}  // namespace linegate::gateway
