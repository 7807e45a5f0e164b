// SPDX-License-Identifier: Apache-2.0
#include <memory>
#include <string>

#include <unistd.h>

#include "bridges/console/monitor.h"
#include "gateway/cli/command_line.h"
#include "gateway/cli/commands.h"
#include "gateway/runtime/signals.h"

namespace linegate::gateway {
namespace {

struct MonitorArguments {
  console::MonitorOptions options;
  std::string node;
  double duration = 0;  // seconds
};

int run_monitor(console::Context& context, MonitorArguments& arguments) {
  console::MonitorOptions& options = arguments.options;
  console::Model model;
  if (const int code = console::find_node(context, model, arguments.node, options.filter);
      code != console::kDone) {
    return code;
  }
  options.duration = seconds(arguments.duration);
  const bool screen = !options.once && !context.json && isatty(STDOUT_FILENO) != 0;
  if (screen) {
    return console::monitor_screen(context, options, model, stop_signal_caught);
  }
  // Without a terminal, prints once unless a duration or JSON was requested.
  options.once = options.once || (!context.json && arguments.duration <= 0);
  return console::monitor_text(context, options, model, stop_signal_caught);
}

}  // namespace

void add_monitor(CommandLine& line) {
  const auto arguments = std::make_shared<MonitorArguments>();
  CLI::App* monitor =
      line.app().add_subcommand("monitor", "live view: lines, nodes, values, events");
  monitor->add_option("--duration", arguments->duration, "end after this time, e.g. 30s")
      ->transform(CLI::AsNumberWithUnit(units_of_seconds()))
      ->check(seconds_from_zero());
  monitor->add_flag("--once", arguments->options.once,
                    "print the present state once; with --json as one document");
  monitor->add_option("--line", arguments->options.filter.line, "show only this line");
  monitor->add_option("--node", arguments->node, "show only this node, by its node-ID or its name");
  line.on_live(monitor, {.images = true, .events = true},
               [arguments](console::Context& context) { return run_monitor(context, *arguments); });
}

}  // namespace linegate::gateway
