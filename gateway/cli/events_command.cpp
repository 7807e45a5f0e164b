// SPDX-License-Identifier: Apache-2.0
#include <memory>

#include "bridges/console/events.h"
#include "gateway/cli/command_line.h"
#include "gateway/cli/commands.h"
#include "gateway/runtime/signals.h"

namespace linegate::gateway {

void add_events(CommandLine& line) {
  const auto request = std::make_shared<console::EventsRequest>();
  CLI::App* events = line.app().add_subcommand("events", "print stored events, then new ones");
  events->add_option("line", request->line);
  events->add_option("-n,--count", request->count, "print the newest N events, and end")
      ->check(count_from_one());
  events->add_flag("--once", request->once, "end after the stored events");
  events->add_option("--since", request->since,
                     "10min, 2h, 3d ago, today, yesterday, or \"2026-11-21 12:34\"");
  events->add_option("--severity", request->severity, "lowest severity: info, warning or error");
  line.on_live(events, {.events = true}, [request](console::Context& c) {
    return console::events(c, *request, stop_signal_caught);
  });
}

}  // namespace linegate::gateway
