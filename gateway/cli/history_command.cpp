// SPDX-License-Identifier: Apache-2.0
#include <chrono>
#include <functional>
#include <iostream>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "bridges/console/history.h"
#include "gateway/cli/command_line.h"
#include "gateway/cli/commands.h"
#include "gateway/cli/problems_as_json.h"
#include "gateway/runtime/clock.h"
#include "gateway/runtime/signals.h"
#include "gateway/tools/history.h"
#include "gateway/tools/value_history.h"

namespace linegate::gateway {
namespace {

constexpr auto kFollowPeriod = std::chrono::milliseconds(250);

struct WantedValues {
  bool wanted = false;
  std::vector<std::string> entries;
  bool csv = false;
};

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

console::HistoryRequest request_of(const HistoryOptions& options, const WantedValues& values) {
  return {.line = options.line,
          .node = options.node,
          .kind = options.kind,
          .severity = options.severity,
          .text = options.text,
          .since = options.since,
          .until = options.until,
          .count = options.count,
          .values = values.wanted,
          .entries = values.entries,
          .csv = values.csv};
}

int values_of_file(const HistoryOptions& options, const console::HistoryRequest& request) {
  return with_problems_as_json(options.json, [&] {
    return value_history(options.file, request, monotonic_now() + WallClock().map().offset,
                         {.out = std::cout,
                          .err = std::cerr,
                          .json = options.json,
                          .csv = request.csv,
                          .utc = options.utc});
  });
}

int of_gateways(const CommandLine& line, const console::HistoryRequest& request, bool follow) {
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
  CLI::Option* const until =
      command->add_option("--until", options->until, "the same: events before that time");
  command->add_option("--severity", options->severity, "info, warning or error: these and worse");
  command->add_option("--node", options->node, "LINE:5, LINE:NAME, or 5 of each line");
  command->add_option("--kind", options->kind, "such as heartbeat-lost");
  command->add_option("--text", options->text, "part of the text");
  command->add_option("-n,--count", options->count, "the newest so many")->check(count_from_one());
  command->add_flag("-f,--follow", *follow, "then later events, until a signal")->excludes(until);
  const auto values = std::make_shared<WantedValues>();
  CLI::Option* const wanted =
      command
          ->add_option("--values", values->entries,
                       "instead of events, values of these entries, of all without a name; inlet.*")
          ->expected(0, -1)
          ->type_name("ENTRY");
  command->add_flag("--csv", values->csv, "values as CSV")->needs(wanted);
  line.on(command, [&line, options, follow, values, wanted] {
    values->wanted = wanted->count() != 0;
    if (*follow) {
      catch_stop_signals();
    }
    options->json = line.common().json;
    options->utc = line.common().utc;
    const console::HistoryRequest request = request_of(*options, *values);
    if (options->file.empty()) {
      return of_gateways(line, request, *follow);
    }
    if (values->wanted && *follow) {
      return line.usage_error("--follow of values needs a gateway, not a file");
    }
    return values->wanted ? values_of_file(*options, request) : of_file(*options, *follow);
  });
}

}  // namespace linegate::gateway
