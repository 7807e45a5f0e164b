// SPDX-License-Identifier: Apache-2.0
#include "gateway/cli/command_line.h"

#include <algorithm>
#include <cstdint>
#include <exception>
#include <iostream>
#include <limits>
#include <utility>

#include "gateway/cli/remote_client.h"
#include "gateway/cli/unknown_command.h"
#include "gateway/cli/usage_error.h"
#include "gateway/publish/dds_edge.h"
#include "gateway/publish/foreign_text.h"
#include "gateway/runtime/exit_code.h"
#include "gateway/runtime/signals.h"

namespace linegate::gateway {
namespace {

// Used with --verbose only, because these messages would disturb the screen, and output that a
// script reads.
void print_library_message(Severity severity, std::string_view text) {
  std::cerr << "Fast DDS: " << (severity == Severity::error ? "error: " : "warning: ")
            << printable(text) << '\n';
}

}  // namespace

CommandLine::CommandLine() {
  app_.require_subcommand(1);
  app_.fallthrough();
  app_.set_version_flag("--version", LINEGATE_VERSION);
  app_.add_option("-d,--domain", common_.domain, "DDS domain")->check(CLI::Range(0, 232));
  app_.add_option("--profile", common_.profile, "QoS profile file instead of the installed one");
  app_.add_option("--security", common_.security,
                  "folder of an identity (linegate security issue), for a plant with DDS-Security")
      ->envname("LINEGATE_SECURITY");
  app_.add_option("--interface", common_.interfaces,
                  "use DDS on this interface only, a name or an address; may be repeated")
      ->expected(1);
  app_.add_option("--peer", common_.peers,
                  "host of a gateway that multicast does not reach; may be repeated")
      ->expected(1);
  app_.add_option("--discovery-server", common_.servers,
                  "discovery server of Fast DDS instead of multicast, [ID@]HOST[:PORT]; may be "
                  "repeated")
      ->expected(1);
  app_.add_flag("--multicast", common_.multicast,
                "receive process images by multicast from gateways with dds: {fan_out: multicast}");
  app_.add_option("--only", common_.only,
                  "receive this line alone, GATEWAY/LINE, of a gateway with dds: {partitions: "
                  "true}; may be repeated")
      ->expected(1);
  app_.add_option("--wait", common_.wait, "seconds to wait for a gateway")
      ->check(seconds_from_zero());
  app_.add_option("--timeout", common_.timeout, "seconds to wait for an answer")
      ->check(seconds_above_zero());
  app_.add_flag("--json", common_.json, "print JSON");
  app_.add_flag("--utc", common_.utc,
                "print times in UTC instead of local time; JSON is always in UTC");
  app_.add_flag("--verbose", common_.verbose, "print messages of Fast DDS on standard error");
  app_.footer(
      "Exit status: 0 done, 1 failed or refused, 2 wrong usage or configuration, 3 printed, but\n"
      "incomplete, 4 a value was taken, but its PDO is not sent yet (0 with --keep, and while "
      "the\n"
      "line's pdo_update_time runs).\n"
      "A line is named by its name or its network-ID, with GATEWAY/ before it where several\n"
      "gateways have such a line; a node is LINE:NODE, by its node-ID or its name: press:5,\n"
      "press:inlet, 3:12, hall-7/press:5, press:own. An object is INDEX:SUB, hexadecimal:\n"
      "1018:01.");
}

void CommandLine::on(CLI::App* command, Action action) {
  command->callback([this, action = std::move(action)] { action_ = action; });
}

void CommandLine::on(CLI::App* command, const Topics& topics, ClientAction action) {
  on(command, [this, topics, action = std::move(action)] { return with_client(topics, action); });
}

void CommandLine::on_live(CLI::App* command, const Topics& topics, ClientAction action) {
  on(command, topics, [action = std::move(action)](console::Context& context) {
    catch_stop_signals();
    return action(context);
  });
}

int CommandLine::with_client(const Topics& topics, const ClientAction& action) const {
  const DdsLibraryLog library_log(common_.verbose
                                      ? std::function(print_library_message)
                                      : std::function<void(Severity, std::string_view)>());
  auto made = make_remote_client({.domain = common_.domain,
                                  .profile = common_.profile,
                                  .security = common_.security,
                                  .interfaces = common_.interfaces,
                                  .peers = common_.peers,
                                  .servers = common_.servers,
                                  .multicast = common_.multicast,
                                  .only = common_.only,
                                  .images = topics.images,
                                  .layouts = topics.layouts,
                                  .events = topics.events,
                                  .commands = topics.commands,
                                  .outputs = topics.outputs});
  RecordingStream out(std::cout);
  RecordingStream err(std::cerr);
  for (const Diagnostic& diagnostic : made.diagnostics) {
    err << to_string(diagnostic) << '\n';
  }
  if (!made.ok()) {
    common_.json ? print_failure(std::cout, err.text()) : void();
    return kExitFailed;
  }
  console::Context context{
      .client = **made.value,
      .out = out,
      .err = err,
      .json = common_.json,
      .utc = common_.utc,
      .wait = seconds(common_.wait),
      .timeout = seconds(common_.timeout),
      .dds = {.domain = common_.domain, .security = common_.security, .profile = common_.profile}};
  const int code = action(context);
  if (code == console::kUsage && common_.json) {
    print_usage_error(std::cout, err.text());
  } else if (code == console::kFailed && common_.json && out.text().empty()) {
    print_failure(std::cout, err.text());
  }
  return code;
}

int CommandLine::usage_error(const std::string& text) const {
  std::cerr << text << '\n';
  common_.json ? print_usage_error(std::cout, text) : void();
  return kExitUsage;
}

int CommandLine::run(int argc, char** argv) {
  try {
    app_.parse(argc, argv);
  } catch (const CLI::Success& done) {
    return app_.exit(done);
  } catch (const CLI::ParseError& problem) {
    return wrong_usage(problem, std::ranges::count(argv, argv + argc, std::string("--json")) != 0);
  }
  try {
    return action_();
    // Thrown by a library, for example for an unreadable file
  } catch (const std::exception& error) {
    std::cerr << "error: " << error.what() << '\n';
    if (common_.json) {
      print_failure(std::cout, error.what());
    }
    return kExitFailed;
  }
}

int CommandLine::wrong_usage(const CLI::ParseError& problem, bool json) {
  std::string text = unknown_command(app_);
  if (text.empty()) {
    app_.exit(problem);
    text = problem.what();
  } else {
    std::cerr << text << '\n';
  }
  json ? print_usage_error(std::cout, text) : void();
  return kExitUsage;
}

const std::map<std::string, double>& units_of_seconds() {
  static const std::map<std::string, double> kUnits{{"s", 1.0}, {"ms", 0.001}, {"min", 60.0}};
  return kUnits;
}

namespace {

CLI::Validator seconds_to_a_year(bool may_be_zero) {
  const auto check = [may_be_zero](const std::string& text) {
    constexpr double kYear = 365.0 * 24 * 60 * 60;
    double value = 0;
    const bool good = CLI::detail::lexical_cast(text, value) && value <= kYear &&
                      (may_be_zero ? value >= 0 : value > 0);
    return good ? std::string()
                : "'" + text + "' is no time: " + (may_be_zero ? "0 s" : "more than 0 s") +
                      ", and a year at most";
  };
  return CLI::Validator(check, "");
}

}  // namespace

CLI::Validator seconds_from_zero() {
  return seconds_to_a_year(true);
}

CLI::Validator seconds_above_zero() {
  return seconds_to_a_year(false);
}

CLI::Validator count_from_one() {
  return CLI::Range(std::int64_t{1}, std::numeric_limits<std::int64_t>::max());
}

Duration seconds(double value) {
  return std::chrono::duration_cast<Duration>(std::chrono::duration<double>(value));
}

}  // namespace linegate::gateway
