// SPDX-License-Identifier: Apache-2.0
// linegate: the console. Displays what gateways publish, sends commands to their lines, checks
// configurations, and simulates devices on an interface.
#include "gateway/cli/command_line.h"
#include "gateway/cli/commands.h"
#include "gateway/runtime/assertion_report.h"

int main(int argc, char** argv) {
  linegate::gateway::report_assertions();
  linegate::gateway::CommandLine line;
#define LINEGATE_ADD_COMMAND(name) linegate::gateway::add_##name(line);
  LINEGATE_COMMANDS(LINEGATE_ADD_COMMAND)
#undef LINEGATE_ADD_COMMAND
  return line.run(argc, argv);
}
