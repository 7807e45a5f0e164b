// SPDX-License-Identifier: Apache-2.0
// Commands for the bus of a line: restart after bus-off, and faults of a simulated bus.
#include <memory>
#include <string>
#include <vector>

#include "gateway/cli/command_line.h"
#include "gateway/cli/commands.h"

namespace linegate::gateway {
namespace {

struct FaultArguments {
  std::string line;
  std::vector<std::string> faults;
};

}  // namespace

void add_bus_restart(CommandLine& line) {
  const auto name = std::make_shared<std::string>();
  CLI::App* restart = line.app().add_subcommand(
      "bus-restart", "restart the CAN controller of a line after bus-off");
  restart->add_option("line", *name)->required();
  line.on(restart, {.commands = true},
          [name](console::Context& c) { return console::bus_restart(c, *name); });
}

void add_fault(CommandLine& line) {
  const auto arguments = std::make_shared<FaultArguments>();
  CLI::App* fault = line.app().add_subcommand(
      "fault", "change the faults of a simulated bus; without arguments: print them");
  fault->add_option("line", arguments->line)->required();
  fault->add_option("faults", arguments->faults,
                    "lost=1%, disturbed=1%, doubled=1%, stuck=5@always, bus_off=now, ...=off; off");
  line.on(fault, {.commands = true}, [arguments](console::Context& c) {
    return console::fault(c, arguments->line, arguments->faults);
  });
}

}  // namespace linegate::gateway
