// SPDX-License-Identifier: Apache-2.0
#include <memory>

#include "gateway/cli/command_line.h"
#include "gateway/cli/commands.h"
#include "gateway/cli/problems_as_json.h"
#include "gateway/runtime/signals.h"
#include "gateway/tools/replay.h"

namespace linegate::gateway {

void add_replay(CommandLine& line) {
  const auto options = std::make_shared<ReplayCommand>();
  CLI::App* command =
      line.app().add_subcommand("replay", "send the frames of a candump log on an interface");
  command->add_option("log", options->file, "log of candump -L or linegate record")->required();
  command->add_option("interface", options->uri, "e.g. socketcan:vcan0")->required();
  command->add_option("--speed", options->speed,
                      "factor of the recorded speed, 0.1 to 1000, or max for as fast as possible");
  command->add_option("--log-interface", options->log_interface,
                      "send only the frames of this interface in the log");
  line.on(command, [&line, options] {
    block_stop_signals();
    limit_end(kEndLimit);
    return with_problems_as_json(line.common().json, [&] { return replay(*options); });
  });
}

}  // namespace linegate::gateway
