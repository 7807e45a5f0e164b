// SPDX-License-Identifier: Apache-2.0
// The gateway process: runs the lines of a plant.yaml until a stop signal.
#include <algorithm>
#include <chrono>
#include <cstdint>
#include <ctime>
#include <exception>
#include <optional>
#include <random>
#include <string>

#include <CLI/CLI.hpp>
#include <spdlog/spdlog.h>

#include "gateway/config/hints.h"
#include "gateway/process/gateway.h"
#include "gateway/process/service.h"
#include "gateway/publish/dds_edge.h"
#include "gateway/publish/library_logger.h"
#include "gateway/publish/peer_process.h"
#include "gateway/runtime/assertion_report.h"
#include "gateway/runtime/clock.h"
#include "gateway/runtime/exit_code.h"
#include "gateway/runtime/log.h"
#include "gateway/runtime/signals.h"
#include "gateway/tools/check.h"

namespace linegate::gateway {
namespace {

struct Arguments {
  std::string plant;
  bool check = false;
  std::string log_level;
  std::string dds_profile;
  std::optional<std::uint32_t> dds_domain;
  double last_words = 0.5;  // seconds
};

// Random for each start; 0 is reserved for "any incarnation".
std::uint64_t random_incarnation() {
  std::random_device device;
  std::uint64_t value = 0;
  while (value == 0) {
    value = std::uint64_t{device()} << 32U | device();
  }
  return value;
}

// Time limit of the shutdown: the wait for subscribers (--last-words), plus everything else.
Duration end_limit(const Arguments& arguments) {
  constexpr std::chrono::duration<double> kForTheRest{4.5};
  return std::chrono::duration_cast<Duration>(
      kForTheRest + std::chrono::duration<double>(std::max(arguments.last_words - 0.5, 0.0)));
}

// The configuration with the options of the command line applied; diagnostics if it is invalid.
Loaded<config::Plant> load(const Arguments& arguments) {
  auto loaded = config::load(arguments.plant);
  if (!loaded.value) {
    return loaded;
  }
  config::Plant& plant = *loaded.value;
  if (!arguments.dds_profile.empty()) {
    plant.dds_profile = arguments.dds_profile;
  }
  plant.dds_domain = arguments.dds_domain.value_or(plant.dds_domain);
  plant.dds_last_words =
      std::chrono::duration_cast<Duration>(std::chrono::duration<double>(arguments.last_words));
  plant.log = config::parse_log_level(arguments.log_level).value_or(plant.log);
  add_hints(loaded);
  return loaded;
}

// The same for a reload: a disk that fails while the files are read must not end running lines.
Loaded<config::Plant> load_again(const Arguments& arguments) {
  try {
    auto loaded = load(arguments);
    if (loaded.value) {
      const auto found = check_dds_permissions(*loaded.value);
      loaded.diagnostics.insert(loaded.diagnostics.end(), found.begin(), found.end());
      if (has_errors(found)) {
        loaded.value.reset();
      }
    }
    return loaded;
  } catch (const std::exception& error) {
    Loaded<config::Plant> failed;
    failed.diagnostics.push_back({Severity::error, arguments.plant, 0, 0, error.what()});
    return failed;
  }
}

void reload(Gateway& gateway, const Loaded<config::Plant>& loaded) {
  log(loaded.diagnostics);
  if (loaded.value) {
    const auto result = gateway.reload(*loaded.value);
    log(result.diagnostics);
    if (result.done) {
      set_log_level(loaded.value->log);
      spdlog::info("reloaded: {}", describe(result.difference));
      return;
    }
  } else {
    gateway.refuse_reload(loaded.diagnostics);
  }
  spdlog::error("not reloaded: everything runs as before");
}

int run(const config::Plant& plant, const Arguments& arguments) {
  const std::uint64_t incarnation = random_incarnation();
  auto made = Gateway::make(plant, incarnation);
  print(made.diagnostics);
  if (!made.value) {
    return kExitFailed;
  }
  spdlog::info("{} starts: gateway {}, DDS domain {}, {} lines, incarnation {:016x}", versions(),
               plant.gateway, plant.dds_domain, plant.lines.size(), incarnation);
  Gateway& gateway = **made.value;
  Service(gateway, [&gateway, arguments]() -> Background::Rest {
    spdlog::info("SIGHUP: {} is read again", arguments.plant);
    return [&gateway, loaded = load_again(arguments)] { reload(gateway, loaded); };
  }).run();
  made.value.reset();
  spdlog::info("stopped");
  return kExitOk;
}

int start(const Arguments& arguments) {
  if (arguments.check) {
    return check(arguments.plant, false, arguments.dds_profile);
  }
  auto loaded = load(arguments);
  if (loaded.value) {
    const auto found = check_dds_profiles(loaded.value->dds_profile);
    loaded.diagnostics.insert(loaded.diagnostics.end(), found.begin(), found.end());
    const auto identity = check_dds_identity(*loaded.value, std::time(nullptr));
    loaded.diagnostics.insert(loaded.diagnostics.end(), identity.begin(), identity.end());
  }
  print(loaded.diagnostics);
  if (!loaded.value || has_errors(loaded.diagnostics)) {
    return kExitUsage;
  }
  set_up_log(loaded.value->log);
  LibraryLogger logger;
  const DdsLibraryLog library_log([&logger](Severity severity, std::string_view text) {
    logger.write(severity, text, monotonic_now());
  });
  log(check_dds_exposure(*loaded.value));
  return run(*loaded.value, arguments);
}

}  // namespace
}  // namespace linegate::gateway

int main(int argc, char** argv) {
  namespace gateway = linegate::gateway;
  gateway::report_assertions();
  if (argc == 2 && argv[1] == gateway::kDdsProcessArgument) {
    gateway::run_dds_process();
  }
  if (argc == 2 && argv[1] == gateway::kPeerProcessArgument) {
    gateway::run_peer_process();
  }
  gateway::Arguments arguments;
  CLI::App app{"Linegate: runs CANopen lines and publishes them over DDS", "linegated"};
  app.add_option("plant", arguments.plant, "the configuration, plant.yaml")->required();
  app.add_flag("--check", arguments.check, "print what would be run, and end");
  app.add_option("--log-level", arguments.log_level, "overrides the configuration")
      ->check(CLI::IsMember({"trace", "debug", "info", "warning", "error", "off"}));
  app.add_option("--dds-profile", arguments.dds_profile,
                 "QoS profile file instead of the one in the configuration");
  app.add_option("--dds-domain", arguments.dds_domain, "overrides the configuration")
      ->check(CLI::Range(0, 232));
  app.add_option(
         "--last-words", arguments.last_words,
         "seconds to wait at most, before the end, until all subscribers have the last samples")
      ->check(CLI::Range(0.0, 60.0))
      ->capture_default_str();
  app.set_version_flag("--version", gateway::versions());
  app.footer(
      "Ends on SIGINT and SIGTERM; reads the configuration again on SIGHUP.\n"
      "Exit codes: 0 ended as requested, 1 failed while running, 2 the command line, the\n"
      "configuration or the DDS profiles are wrong, 70 a thread did not end within 5 s after the\n"
      "signal (longer with --last-words above 0.5).");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? gateway::kExitOk : gateway::kExitUsage;
  }
  gateway::block_stop_signals();
  gateway::block_reload_signal();
  gateway::limit_end(gateway::end_limit(arguments));
  try {
    return gateway::start(arguments);
  } catch (const std::exception& error) {
    spdlog::critical("{}", error.what());
    return gateway::kExitFailed;
  }
}
