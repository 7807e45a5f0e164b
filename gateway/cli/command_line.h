// SPDX-License-Identifier: Apache-2.0
// The command line of linegate: what its commands have in common, and the one that was typed.
#pragma once

#include <functional>
#include <map>
#include <string>

#include <CLI/CLI.hpp>

#include "bridges/console/commands.h"
#include "stack/base/time.h"

namespace linegate::gateway {

// The options that all commands share.
struct CommonOptions {
  unsigned domain = 0;
  std::string profile;
  double wait = 5;     // seconds for a gateway to appear
  double timeout = 5;  // seconds for an answer
  bool json = false;
  bool utc = false;
  bool verbose = false;
};

// What a command subscribes to besides the states of gateways, lines and nodes.
struct Topics {
  bool images = false;
  bool layouts = images;
  bool events = false;
  bool commands = false;  // it sends some
  bool outputs = false;   // it writes some
};

class CommandLine {
 public:
  // Gives the exit code.
  using Action = std::function<int()>;
  // With a subscriber of the gateways.
  using ClientAction = std::function<int(console::Context&)>;

  CommandLine();
  CommandLine(const CommandLine&) = delete;
  CommandLine& operator=(const CommandLine&) = delete;

  CLI::App& app() { return app_; }
  // As typed, once an action runs.
  const CommonOptions& common() const { return common_; }

  // What the command does when it was typed. What the actions hold must outlive this.
  void on(CLI::App* command, Action action);
  void on(CLI::App* command, const Topics& topics, ClientAction action);
  // The same until SIGINT or SIGTERM: the action polls stop_signal_caught().
  void on_live(CLI::App* command, const Topics& topics, ClientAction action);

  // Within an action, where the topics depend on what was typed. Gives its exit code. With --json a
  // failure without any output is printed as an object.
  int with_client(const Topics& topics, const ClientAction& action) const;
  // Reports wrong usage, on standard error and with --json as an object. Gives the exit code.
  int usage_error(const std::string& text) const;

  // Parses, and does what was typed. Gives the exit code.
  int run(int argc, char** argv);

 private:
  int wrong_usage(const CLI::ParseError& problem, bool json);

  CLI::App app_{"Linegate console: CANopen lines over DDS", "linegate"};
  CommonOptions common_;
  Action action_;
};

// Units of an option that is a number of seconds.
const std::map<std::string, double>& units_of_seconds();
Duration seconds(double value);

}  // namespace linegate::gateway
