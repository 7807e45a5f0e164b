// SPDX-License-Identifier: Apache-2.0
// linegate: the console. See what gateways publish, ask their lines, check a configuration, put
// simulated devices on an interface.
#include <algorithm>
#include <exception>
#include <functional>
#include <iostream>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <CLI/CLI.hpp>
#include <unistd.h>

#include "bridges/console/accept.h"
#include "bridges/console/boot.h"
#include "bridges/console/commands.h"
#include "bridges/console/configuration.h"
#include "bridges/console/emcy_history.h"
#include "bridges/console/events.h"
#include "bridges/console/hold.h"
#include "bridges/console/lookup.h"
#include "bridges/console/monitor.h"
#include "bridges/console/names.h"
#include "bridges/console/program.h"
#include "bridges/console/scan.h"
#include "gateway/cli/data_commands.h"
#include "gateway/cli/file_commands.h"
#include "gateway/cli/lss_options.h"
#include "gateway/cli/plant_names.h"
#include "gateway/cli/remote_client.h"
#include "gateway/cli/scan_command.h"
#include "gateway/cli/unknown_command.h"
#include "gateway/cli/usage_error.h"
#include "gateway/config/whole_file.h"
#include "gateway/publish/dds_edge.h"
#include "gateway/publish/foreign_text.h"
#include "gateway/runtime/assertion_report.h"
#include "gateway/runtime/exit_code.h"
#include "gateway/runtime/signals.h"

namespace linegate::gateway {
namespace {

// What is common to all commands that speak to a gateway.
struct Options {
  unsigned domain = 0;
  std::string profile;
  double wait = 5;
  double timeout = 5;
  bool json = false;
  bool utc = false;
  bool verbose = false;
};

// Messages of Fast DDS, which would disturb the screen and the output that a script reads.
void print_library_message(Severity severity, std::string_view text) {
  std::cerr << "Fast DDS: " << (severity == Severity::error ? "error: " : "warning: ")
            << printable(text) << '\n';
}

Duration seconds(double value) {
  return std::chrono::duration_cast<Duration>(std::chrono::duration<double>(value));
}

std::string content_of(const std::string& path) {
  std::string why;
  auto content = config::whole_file(path, why);
  return content ? *std::move(content) : throw std::runtime_error(path + " " + why);
}

const std::map<std::string, double> kSeconds{{"s", 1.0}, {"ms", 0.001}, {"min", 60.0}};

// Which topics a command needs.
struct Topics {
  bool images = false;
  bool layouts = images;
  bool events = false;
  bool commands = false;
  bool outputs = false;
};

int with_client(const Options& options, const Topics& topics,
                const std::function<int(console::Context&)>& action) {
  const DdsLibraryLog library_log(options.verbose
                                      ? std::function(print_library_message)
                                      : std::function<void(Severity, std::string_view)>());
  auto made = make_remote_client({.domain = options.domain,
                                  .profile = options.profile,
                                  .images = topics.images,
                                  .layouts = topics.layouts,
                                  .events = topics.events,
                                  .commands = topics.commands,
                                  .outputs = topics.outputs});
  KeptStream out(std::cout);
  KeptStream err(std::cerr);
  for (const Diagnostic& diagnostic : made.diagnostics) {
    err << to_string(diagnostic) << '\n';
  }
  if (!made.ok()) {
    options.json ? print_failure(std::cout, err.text()) : void();
    return kExitFailed;
  }
  console::Context context{.client = **made.value,
                           .out = out,
                           .err = err,
                           .json = options.json,
                           .utc = options.utc,
                           .wait = seconds(options.wait),
                           .timeout = seconds(options.timeout)};
  const int code = action(context);
  if (code == console::kUsage && options.json) {
    print_usage_error(std::cout, err.text());
  } else if (code == console::kFailed && options.json && out.text().empty()) {
    print_failure(std::cout, err.text());
  }
  return code;
}

// The texts of one command; CLI11 fills them when it parses.
struct Texts {
  std::string line, entry, value, node, command, code, reg = "0", bytes, via;
};

class Program {
 public:
  Program() {
    app_.require_subcommand(1);
    app_.fallthrough();
    app_.set_version_flag("--version", LINEGATE_VERSION);
    app_.add_option("-d,--domain", options_.domain, "DDS domain")->check(CLI::Range(0, 232));
    app_.add_option("--profile", options_.profile, "QoS profile file instead of the installed one");
    app_.add_option("--wait", options_.wait, "seconds to wait for a gateway")
        ->check(CLI::NonNegativeNumber);
    app_.add_option("--timeout", options_.timeout, "seconds to wait for an answer")
        ->check(CLI::PositiveNumber);
    app_.add_flag("--json", options_.json, "print JSON");
    app_.add_flag("--utc", options_.utc, "times in UTC, not in local time; JSON has always UTC");
    app_.add_flag("--verbose", options_.verbose, "say on standard error what Fast DDS reports");
    app_.footer(
        "Exit status: 0 done, 1 failed or refused, 2 wrong usage or configuration, 3 printed, but\n"
        "incomplete, 4 a value was taken, but its PDO is not sent yet (0 with --keep, and while "
        "the\n"
        "line's pdo_update_time runs).\n"
        "A line is named by its name or its network-ID, with GATEWAY/ before it where several\n"
        "gateways have such a line; a node is LINE:NODE, by its node-ID or its name: press:5,\n"
        "press:inlet, 3:12, hall-7/press:5, press:own. An object is INDEX:SUB, hexadecimal:\n"
        "1018:01.");
    add_views();
    add_names();
    add_commands();
    add_configuration();
    add_program();
    data_.add(
        app_,
        [this](CLI::App* command, DataCommands::Needs needs, DataCommands::Action action) {
          on(command, [this, needs, action = std::move(action)] {
            const bool live = needs == DataCommands::Needs::events;
            const bool layouts = needs == DataCommands::Needs::layouts;
            const Topics topics{.layouts = layouts, .events = live, .commands = true};
            return with_client(options_, topics, [&](auto& c) {
              if (live) {
                catch_stop_signals();
              }
              return action(c);
            });
          });
        },
        stop_signal_caught);
    files_.add(app_, options_.json, [this](CLI::App* command, std::function<int()> action) {
      on(command, std::move(action));
    });
  }

  int run(int argc, char** argv) {
    try {
      app_.parse(argc, argv);
    } catch (const CLI::Success& done) {
      return app_.exit(done);
    } catch (const CLI::ParseError& problem) {
      return wrong_usage(problem,
                         std::ranges::count(argv, argv + argc, std::string("--json")) != 0);
    }
    try {
      return action_();
    } catch (const std::exception& error) {  // of a library, such as a file that cannot be read
      std::cerr << "error: " << error.what() << '\n';
      if (options_.json) {
        print_failure(std::cout, error.what());
      }
      return kExitFailed;
    }
  }

 private:
  int wrong_usage(const CLI::ParseError& problem, bool json) {
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

  void on(CLI::App* command, std::function<int()> action) {
    command->callback([this, action = std::move(action)] { action_ = action; });
  }

  void add_views() {
    CLI::App* monitor = app_.add_subcommand("monitor", "live view: lines, nodes, values, events");
    monitor->add_option("--duration", duration_, "end by itself after so many seconds, e.g. 30s")
        ->transform(CLI::AsNumberWithUnit(kSeconds));
    monitor->add_flag("--once", monitor_.once,
                      "what there is now, and end; with --json one document");
    monitor->add_option("--line", monitor_.filter.line, "only this line");
    monitor->add_option("--node", texts_.node, "only this node: its node-ID, or its name");
    on(monitor, [this] { return run_monitor(); });

    CLI::App* gateways =
        app_.add_subcommand("gateways", "the gateways themselves: version, reloads, DDS counters");
    on(gateways, [this] { return with_client(options_, {}, console::gateways); });

    CLI::App* lines = app_.add_subcommand("lines", "the lines of all gateways and their state");
    on(lines, [this] { return with_client(options_, {}, console::lines); });

    CLI::App* routes =
        app_.add_subcommand("routes", "how other networks are reached, and what is routed");
    on(routes, [this] { return with_client(options_, {}, console::routes); });

    CLI::App* trace = app_.add_subcommand("trace", "what is routed between networks, live");
    trace->add_option("-n,--count", count_, "end after so many");
    on(trace, [this] {
      return with_client(options_, {.events = true, .commands = true}, [&](auto& c) {
        catch_stop_signals();
        return console::trace(c, count_, stop_signal_caught);
      });
    });

    CLI::App* nodes = app_.add_subcommand("nodes", "the nodes of a line, or of all");
    nodes->add_option("line", texts_.line);
    on(nodes, [this] {
      return with_client(options_, {}, [&](auto& c) { return console::nodes(c, texts_.line); });
    });

    CLI::App* image = app_.add_subcommand("image", "the process image of a line, or of all");
    image->add_option("line", texts_.line);
    image->add_flag("-o,--outputs", outputs_, "outputs instead of inputs");
    on(image, [this] {
      const auto direction = outputs_ ? image::Direction::outputs : image::Direction::inputs;
      return with_client(options_, {.images = true},
                         [&](auto& c) { return console::image(c, texts_.line, direction); });
    });

    CLI::App* events =
        app_.add_subcommand("events", "events that are kept, then those that happen");
    events->add_option("line", events_.line);
    events->add_option("-n,--count", events_.count, "the newest so many, and end");
    events->add_flag("--once", events_.once, "end after those that are kept");
    events->add_option("--since", events_.since, "10min, 2h, 3d ago, or \"2026-11-21 12:34\"");
    events->add_option("--severity", events_.severity, "info, warning or error: these and worse");
    on(events, [this] {
      return with_client(options_, {.events = true}, [&](auto& c) {
        catch_stop_signals();
        return console::events(c, events_, stop_signal_caught);
      });
    });
  }

  // For completion by a shell, which has no time: not in the help.
  void add_names() {
    CLI::App* names = app_.add_subcommand("names", "names of lines and nodes, for completion");
    names->group("");
    names->add_option("--plant", file_, "those of a plant.yaml, not of running gateways");
    on(names, [this] {
      return file_.empty() ? with_client(options_, {}, console::names) : print_names(file_);
    });
  }

  void add_commands() {
    CLI::App* write = app_.add_subcommand("write", "give one output a value");
    write->add_option("line", texts_.line)->required();
    write
        ->add_option("entry", texts_.entry,
                     "name, NODE.INDEX:SUB with the name or the node-ID, or number")
        ->required();
    write->add_option("value", texts_.value)->required();
    auto* const hold = write->add_option(
        "--hold", duration_, "the value for so long, e.g. 30s; then its group becomes 0");
    hold->transform(CLI::AsNumberWithUnit(kSeconds))->check(CLI::PositiveNumber);
    write->add_flag("--while", while_, "the same until this command ends (Ctrl-C)")->excludes(hold);
    write
        ->add_option("--group", group_,
                     "the group of outputs that --hold and --while write, if not that of the entry")
        ->check(CLI::Range(0, 0xFFFF));
    on(write, [this] {
      if (while_ || duration_ > 0) {
        return run_hold();
      }
      return with_client(options_, {.images = true, .commands = true}, [&](auto& c) {
        return console::write(c, texts_.line, texts_.entry, texts_.value);
      });
    });

    CLI::App* sdo = app_.add_subcommand("sdo", "read or write an object of a device");
    sdo->require_subcommand(1);
    CLI::App* read = sdo->add_subcommand("read", "print an object's value");
    add_object(read,
               "the object, as 1018:01 or 1018 1, or all of 1018; then the data type if it is not "
               "that of the device file: 1018:01 u32");
    read->add_flag("--from-image", from_image_,
                   "the value of the process image will do, if it is valid")
        ->excludes("--via");
    read->add_flag("--cached", cached_, "what a scan read is good enough");
    on(read, [this] {
      const auto words = console::split_object(words_, 0, 1);
      if (!words) {
        return usage("sdo read LINE:NODE INDEX:SUB [TYPE]");
      }
      const std::string type = words->rest.empty() ? "" : words->rest[0];
      return with_client(options_, {.commands = true}, [&](auto& c) {
        if (from_image_) {
          return console::image_read(c, texts_.node, words->index, words->sub, type);
        }
        return console::sdo_read(c, texts_.node, words->index, words->sub, type, texts_.via,
                                 cached_);
      });
    });
    CLI::App* sdo_write = sdo->add_subcommand("write", "give an object a value");
    add_object(sdo_write,
               "the object and its value, the data type before it if it is not that of the device "
               "file: 1017:00 500, or 1017 0 u16 500");
    sdo_write
        ->add_flag("--by-pdo", by_pdo_,
                   "by PDO if a PDO carries the object; says which way it went")
        ->excludes("--via");
    sdo_write->add_flag("--keep", keep_, "the PDO is not sent before linegate trigger asks for it")
        ->needs("--by-pdo");
    on(sdo_write, [this] {
      if (const std::string why = console::why_ambiguous(words_); !why.empty()) {
        return usage_error(why);
      }
      const auto words = console::split_object(words_, 1, 2);
      if (!words) {
        return usage("sdo write LINE:NODE INDEX:SUB [TYPE] VALUE");
      }
      const std::string type = words->rest.size() == 2 ? words->rest[0] : "";
      const Topics topics{.layouts = by_pdo_, .commands = true};
      return with_client(options_, topics, [&](auto& c) {
        if (by_pdo_) {
          return console::object_write(c, texts_.node, words->index, words->sub, type,
                                       words->rest.back(), keep_);
        }
        return console::sdo_write(c, texts_.node, words->index, words->sub, type,
                                  words->rest.back(), texts_.via);
      });
    });

    CLI::App* nmt = app_.add_subcommand("nmt", "send an NMT command");
    nmt->add_option("command", texts_.command,
                    "start, stop, pre-operational, reset-node, reset-communication")
        ->required();
    nmt->add_option("node", texts_.node, "LINE:NODE or LINE:all")->required();
    on(nmt, [this] {
      return with_client(options_, {.commands = true},
                         [&](auto& c) { return console::nmt(c, texts_.command, texts_.node); });
    });

    CLI::App* emcy = app_.add_subcommand(
        "emcy",
        "the last EMCYs of each node; with a code: send one from the line's own node or device");
    emcy->add_option("line", texts_.line,
                     "LINE, or LINE:NODE for one node; a device of a line in the role "
                     "device sends as LINE:NODE")
        ->required();
    emcy->add_option("code", texts_.code, "emergency error code to send, hexadecimal");
    emcy->add_option("register", texts_.reg, "error register, hexadecimal");
    emcy->add_option("bytes", texts_.bytes, "up to 5 manufacturer bytes, hexadecimal");
    on(emcy, [this] {
      return with_client(options_, {.commands = true}, [&](auto& c) {
        if (texts_.code.empty()) {
          return console::emcy_history(c, texts_.line);
        }
        return console::emcy(c, texts_.line, texts_.code, texts_.reg, texts_.bytes);
      });
    });

    CLI::App* restart = app_.add_subcommand(
        "bus-restart", "bring a line's controller back to the bus after bus-off");
    restart->add_option("line", texts_.line)->required();
    on(restart, [this] {
      return with_client(options_, {.commands = true},
                         [&](auto& c) { return console::bus_restart(c, texts_.line); });
    });

    CLI::App* scan = app_.add_subcommand("scan", "find out what is on a line");
    scan->add_option("line", scan_.what, "LINE, or LINE:NODE for one node")->required();
    scan->add_flag("--apply", scan_.apply,
                   "set up heartbeats where there are none, and run the line with what is found");
    scan->add_flag("--restore-defaults", scan_.restore_defaults,
                   "the devices restore their defaults first; run the line with what is found");
    scan->add_option("--write", scan_folder_, "folder to put a plant.yaml and DCF files into");
    scan->add_option("--eds", eds_folder_, "folder of EDS files, for names and exact types")
        ->check(CLI::ExistingDirectory);
    on(scan, [this] {
      const bool compares = !scan_folder_.empty();
      return with_client(
          options_, {.layouts = compares, .events = true, .commands = true}, [&](auto& c) {
            return scan_and_write(
                c, scan_, {.folder = scan_folder_, .eds = eds_folder_, .domain = options_.domain});
          });
    });

    add_lss(app_, lss_, [this](CLI::App& command) {
      on(&command, [this] {
        return with_client(options_, {.events = true, .commands = true},
                           [&](auto& c) { return console::lss(c, lss_); });
      });
    });

    CLI::App* boot = app_.add_subcommand(
        "boot", "check, configure and start the nodes of a line anew; fails if one is not booted");
    boot->add_option("line", texts_.line, "LINE, or LINE:NODE for one node")->required();
    on(boot, [this] {
      return with_client(options_, {.events = true, .commands = true},
                         [&](auto& c) { return console::boot(c, texts_.line); });
    });

    CLI::App* accept = app_.add_subcommand(
        "accept", "expect the device that is there from now on, and boot it: after an exchange");
    accept->add_option("node", texts_.line, "LINE:NODE")->required();
    on(accept, [this] {
      return with_client(options_, {.events = true, .commands = true},
                         [&](auto& c) { return console::accept(c, texts_.line); });
    });

    CLI::App* fault = app_.add_subcommand(
        "fault", "faults of a bus without wires, on and off; without any: those it has");
    fault->add_option("line", texts_.line)->required();
    fault->add_option(
        "faults", faults_,
        "lost=1%, disturbed=1%, doubled=1%, stuck=5@always, bus_off=now, ...=off; off");
    on(fault, [this] {
      return with_client(options_, {.commands = true},
                         [&](auto& c) { return console::fault(c, texts_.line, faults_); });
    });

    CLI::App* versions = app_.add_subcommand("versions", "versions of a running gateway");
    versions->add_option("line", texts_.line);
    on(versions, [this] {
      return with_client(options_, {.commands = true},
                         [&](auto& c) { return console::versions(c, texts_.line); });
    });
  }

  void add_configuration() {
    CLI::App* config = app_.add_subcommand("config", "configurations of devices (CiA 302-3)");
    config->require_subcommand(1);
    const auto add = [&](const char* name, const char* about, console::ConfigAction action) {
      CLI::App* command = config->add_subcommand(name, about);
      command->add_option("line", texts_.line, "LINE, or LINE:NODE for one node")->required();
      on(command, [this, action] {
        return with_client(options_, {.events = true, .commands = true},
                           [&](auto& c) { return console::configure(c, action, texts_.line); });
      });
    };
    add("verify", "compare what devices have with their configuration; writes nothing",
        console::ConfigAction::verify);
    add("apply", "boot devices anew and write their configuration to them",
        console::ConfigAction::apply);
    CLI::App* import = config->add_subcommand(
        "import", "give a concise DCF to the manager: a node's, or its own objects");
    import->add_option("line", texts_.line, "LINE:NODE, or LINE for the manager itself")
        ->required();
    import->add_option("file", file_)->required()->check(CLI::ExistingFile);
    on(import, [this] {
      return with_client(options_, {.commands = true}, [&](auto& c) {
        const std::string content = content_of(file_);
        return console::import_configuration(c, texts_.line, std::as_bytes(std::span(content)));
      });
    });
  }

  void add_program() {
    CLI::App* program =
        app_.add_subcommand("program", "load a program into a device: stop, clear, load, start");
    program->add_option("node", texts_.node, "LINE:NODE")->required();
    program->add_option("file", file_)->required()->check(CLI::ExistingFile);
    program->add_option("--number", number_, "of the program: sub-index of 1F50h, 1F51h, 1F57h")
        ->check(CLI::Range(1, 255));
    on(program, [this] {
      return with_client(options_, {.events = true, .commands = true}, [&](auto& c) {
        const std::string content = content_of(file_);
        const auto bytes = std::as_bytes(std::span(content));
        return console::load_program(c, texts_.node, static_cast<std::uint8_t>(number_),
                                     {bytes.begin(), bytes.end()});
      });
    });
  }

  int usage(const std::string& form) const {
    return usage_error("usage: linegate " + form + "; index and sub-index are hexadecimal");
  }

  int usage_error(const std::string& text) const {
    std::cerr << text << '\n';
    options_.json ? print_usage_error(std::cout, text) : void();
    return kExitUsage;
  }

  void add_object(CLI::App* command, const char* words) {
    command->add_option("node", texts_.node, "LINE:NODE, or LINE:all for each node")->required();
    command->add_option("object", words_, words)->required()->expected(1, 4);
    command->add_option(
        "--via", texts_.via,
        "in the place of a device on this line: the rules enter: of the line with the node apply");
  }

  int run_hold() {
    const Topics topics{.images = true, .events = true, .outputs = true};
    return with_client(options_, topics, [this](console::Context& c) {
      catch_stop_signals();
      return console::hold(c,
                           {.line = texts_.line,
                            .entry = texts_.entry,
                            .value = texts_.value,
                            .group = group_,
                            .time = seconds(duration_)},
                           stop_signal_caught);
    });
  }

  int run_monitor() {
    return with_client(options_, {.images = true, .events = true}, [this](console::Context& c) {
      catch_stop_signals();
      console::Model model;
      if (const int code = console::find_node(c, model, texts_.node, monitor_.filter);
          code != console::kDone) {
        return code;
      }
      monitor_.duration = seconds(duration_);
      const bool screen = !monitor_.once && !options_.json && isatty(STDOUT_FILENO) != 0;
      if (screen) {
        return console::monitor_screen(c, monitor_, model, stop_signal_caught);
      }
      // What is no terminal gets one picture, unless it asked for more.
      monitor_.once = monitor_.once || (!options_.json && duration_ <= 0);
      return console::monitor_text(c, monitor_, model, stop_signal_caught);
    });
  }

  CLI::App app_{"Linegate console: CANopen lines over DDS", "linegate"};
  std::function<int()> action_;
  Options options_;
  Texts texts_;
  double duration_ = 0;
  console::MonitorOptions monitor_;
  console::EventsRequest events_;
  DataCommands data_;
  FileCommands files_;
  std::vector<std::string> words_;  // an object, and what follows
  bool outputs_ = false;
  bool from_image_ = false;
  bool by_pdo_ = false;
  bool keep_ = false;
  bool while_ = false;
  std::optional<std::uint16_t> group_;
  std::vector<std::string> faults_;
  std::uint64_t count_ = 0;
  std::string file_;
  unsigned number_ = 1;
  console::ScanRequest scan_;
  bool cached_ = false;
  std::string scan_folder_;
  std::string eds_folder_;
  console::LssRequest lss_;
};

}  // namespace
}  // namespace linegate::gateway

int main(int argc, char** argv) {
  linegate::gateway::report_assertions();
  return linegate::gateway::Program().run(argc, argv);
}
