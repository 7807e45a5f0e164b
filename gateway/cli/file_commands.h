// SPDX-License-Identifier: Apache-2.0
// The subcommands of linegate that need no running gateway: check, eds, dcf, simulate, record,
// replay and decode.
#pragma once

#include <functional>
#include <string>

#include "gateway/tools/decode.h"
#include "gateway/tools/record.h"
#include "gateway/tools/replay.h"
#include "gateway/tools/simulate.h"

namespace CLI {
class App;
}

namespace linegate::gateway {

// Keeps what was typed: must outlive the program's parsing and the action.
class FileCommands {
 public:
  // To do the action when that command was typed; it gives the exit status.
  using On = std::function<void(CLI::App* command, std::function<int()> action)>;

  // json: whether JSON is printed, as it is when an action runs.
  void add(CLI::App& app, const bool& json, const On& on);

 private:
  void add_plant(CLI::App& app, const bool& json, const On& on);
  void add_simulate(CLI::App& app, const bool& json, const On& on);
  void add_recording(CLI::App& app, const bool& json, const On& on);
  void add_replay(CLI::App& app, const bool& json, const On& on);
  void add_decode(CLI::App& app, const bool& json, const On& on);

  std::string plant_, line_, running_;
  bool concise_ = false;
  SimulateOptions simulation_;
  RecordOptions recording_;
  ReplayCommand replay_;
  DecodeOptions decode_;
};

}  // namespace linegate::gateway
