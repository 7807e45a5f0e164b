// SPDX-License-Identifier: Apache-2.0
// Commands for routing between networks (CiA 302-7).
#include <cstdint>
#include <memory>

#include "gateway/cli/command_line.h"
#include "gateway/cli/commands.h"
#include "gateway/runtime/signals.h"

namespace linegate::gateway {

void add_routes(CommandLine& line) {
  CLI::App* routes = line.app().add_subcommand(
      "routes", "print the routes to other networks, and the routed connections");
  line.on(routes, {}, console::routes);
}

void add_trace(CommandLine& line) {
  const auto count = std::make_shared<std::uint64_t>(0);
  CLI::App* trace =
      line.app().add_subcommand("trace", "print the traffic routed between networks, live");
  trace->add_option("-n,--count", *count, "end after N lines")->check(count_from_one());
  line.on_live(trace, {.events = true, .commands = true}, [count](console::Context& c) {
    return console::trace(c, *count, stop_signal_caught);
  });
}

}  // namespace linegate::gateway
