// SPDX-License-Identifier: Apache-2.0
// The subcommands of linegate about data beyond outputs and SDO: trigger, od, send and listen.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "bridges/console/commands.h"
#include "bridges/console/dictionary.h"

namespace CLI {
class App;
}

namespace linegate::gateway {

// Keeps what was typed: must outlive the program's parsing and the action.
class DataCommands {
 public:
  using Action = std::function<int(console::Context&)>;
  // What an action needs besides replies; with events it is live, until a signal ends it.
  enum class Needs { nothing, layouts, events };
  // To do the action when that command was typed.
  using On = std::function<void(CLI::App* command, Needs needs, Action action)>;

  void add(CLI::App& app, const On& on, const std::function<bool()>& stopped);

 private:
  void add_trigger(CLI::App& app, const On& on);
  void add_pdo(CLI::App& app, const On& on);
  void add_frames(CLI::App& app, const On& on, const std::function<bool()>& stopped);
  void add_dictionary(CLI::App& app, const On& on);

  std::string line_, value_;
  std::vector<std::string> words_;  // an object, and what follows
  console::NewObject object_;
  bool by_offset_ = false;
  bool own_ = false;
  std::uint64_t count_ = 0;
};

}  // namespace linegate::gateway
