// SPDX-License-Identifier: Apache-2.0
#include <chrono>
#include <functional>
#include <iostream>
#include <memory>
#include <thread>

#include "bridges/console/history.h"
#include "gateway/cli/command_line.h"
#include "gateway/cli/commands.h"
#include "gateway/cli/problems_as_json.h"
#include "gateway/runtime/clock.h"
#include "gateway/runtime/signals.h"
#include "gateway/tools/history.h"

namespace linegate::gateway {
namespace {

constexpr auto kFollowPeriod = std::chrono::milliseconds(250);

int of_file(const HistoryOptions& options, bool follow) {
  return with_problems_as_json(options.json, [&] {
    const Instant now = monotonic_now() + WallClock().map().offset;
    const auto wait = [] {
      std::this_thread::sleep_for(kFollowPeriod);
      return std::cout.good() && !stop_signal_caught();
    };
    return history(options, now, std::cout, std::cerr,
                   follow ? std::function<bool()>(wait) : std::function<bool()>());
  });
}

int of_gateways(const CommandLine& line, const HistoryOptions& options, bool follow) {
  const console::HistoryRequest request{.line = options.line,
                                        .node = options.node,
                                        .kind = options.kind,
                                        .severity = options.severity,
                                        .text = options.text,
                                        .since = options.since,
                                        .until = options.until,
                                        .count = options.count};
  return line.with_client({.commands = true}, [&](console::Context& context) {
    return console::history(context, request, follow, stop_signal_caught);
  });
}

}  // namespace

void add_history(CommandLine& line) {
  const auto options = std::make_shared<HistoryOptions>();
  const auto follow = std::make_shared<bool>(false);
  CLI::App* command = line.app().add_subcommand(
      "history", "stored events of gateways, or of a journal on this host");
  command->add_option("line", options->line);
  command->add_option("--journal", options->file, "a file on this host, as plant.yaml names it");
  command->add_option("--since", options->since,
                      "10min, 2h, 3d ago, today, yesterday, or \"2026-11-21 12:34\"");
  command->add_option("--until", options->until, "the same: events before that time");
  command->add_option("--severity", options->severity, "info, warning or error: these and worse");
  command->add_option("--node", options->node, "LINE:5, or 5 of each line");
  command->add_option("--kind", options->kind, "such as heartbeat-lost");
  command->add_option("--text", options->text, "part of the text");
  command->add_option("-n,--count", options->count, "the newest so many");
  command->add_flag("-f,--follow", *follow, "then later events, until a signal");
  line.on(command, [&line, options, follow] {
    if (*follow) {
      catch_stop_signals();
    }
    options->json = line.common().json;
    options->utc = line.common().utc;
    return options->file.empty() ? of_gateways(line, *options, *follow)
                                 : of_file(*options, *follow);
  });
}

}  // namespace linegate::gateway
