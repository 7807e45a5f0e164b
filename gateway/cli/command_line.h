// SPDX-License-Identifier: Apache-2.0
// The command line of linegate: the common part of its commands, and the selected command.
#pragma once

#include <functional>
#include <map>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>

#include "bridges/console/commands.h"
#include "stack/base/time.h"

namespace linegate::gateway {

// The options of all commands.
struct CommonOptions {
  unsigned domain = 0;
  std::string profile;
  std::string security;                 // folder of an identity; empty = without DDS-Security
  std::vector<std::string> interfaces;  // of this host, for DDS; none = those of the profile
  std::vector<std::string> peers;       // hosts that multicast does not reach
  std::vector<std::string> servers;     // discovery servers, instead of multicast and peers
  bool multicast = false;               // receive images by multicast
  std::vector<std::string> only;        // lines to receive; none = all
  double wait = 5;                      // time limit for the discovery of a gateway, in seconds
  double timeout = 5;                   // time limit for an answer, in seconds
  bool json = false;
  bool utc = false;
  bool verbose = false;
};

// The topics of a command besides the states of gateways, lines and nodes.
struct Topics {
  bool images = false;
  bool layouts = images;
  bool events = false;
  bool commands = false;  // sends commands
  bool outputs = false;   // writes outputs
};

class CommandLine {
 public:
  // Returns the exit code.
  using Action = std::function<int()>;
  // An action that needs a subscriber.
  using ClientAction = std::function<int(console::Context&)>;

  CommandLine();
  CommandLine(const CommandLine&) = delete;
  CommandLine& operator=(const CommandLine&) = delete;

  CLI::App& app() { return app_; }
  // Parsed when an action runs.
  const CommonOptions& common() const { return common_; }

  // Sets the action of a command. References in the action must outlive this object.
  void on(CLI::App* command, Action action);
  void on(CLI::App* command, const Topics& topics, ClientAction action);
  // The same for a command that runs until SIGINT or SIGTERM: the action polls
  // stop_signal_caught().
  void on_live(CLI::App* command, const Topics& topics, ClientAction action);

  // Called within an action if the topics depend on the arguments. Returns the exit code of the
  // action. With --json, a failure without any output is printed as an object.
  int with_client(const Topics& topics, const ClientAction& action) const;
  // Reports wrong usage on standard error, and with --json as an object. Returns the exit code.
  int usage_error(const std::string& text) const;

  // Parses the arguments and runs the action of the command. Returns the exit code.
  int run(int argc, char** argv);

 private:
  int wrong_usage(const CLI::ParseError& problem, bool json);

  CLI::App app_{"Linegate console: CANopen lines over DDS", "linegate"};
  CommonOptions common_;
  Action action_;
};

// Units of an option in seconds.
const std::map<std::string, double>& units_of_seconds();
Duration seconds(double value);
// A number of seconds from 0, or more than 0, to a year; not nan.
CLI::Validator seconds_from_zero();
CLI::Validator seconds_above_zero();
// A whole number from 1.
CLI::Validator count_from_one();

}  // namespace linegate::gateway
