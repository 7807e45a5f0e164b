// SPDX-License-Identifier: Apache-2.0
#include "gateway/cli/file_commands.h"

#include <functional>
#include <iostream>

#include <CLI/CLI.hpp>

#include "gateway/cli/usage_error.h"
#include "gateway/runtime/exit_code.h"
#include "gateway/runtime/signals.h"
#include "gateway/tools/check.h"
#include "gateway/tools/check_reload.h"
#include "gateway/tools/device_file.h"

namespace linegate::gateway {
namespace {

// What is redirected goes to a stream that keeps it, too.
class KeptOutput {
 public:
  explicit KeptOutput(std::ostream& stream) : stream_(stream), kept_(stream) {
    before_ = stream.rdbuf(kept_.rdbuf());
  }
  ~KeptOutput() { stream_.rdbuf(before_); }
  KeptOutput(const KeptOutput&) = delete;
  KeptOutput& operator=(const KeptOutput&) = delete;

  const std::string& text() const { return kept_.text(); }

 private:
  std::ostream& stream_;
  KeptStream kept_;  // writes to the buffer that the stream had before
  std::streambuf* before_ = nullptr;
};

// With --json wrong usage, and a failure without any result, which are said on standard error, are
// objects on standard output too.
int with_problems_as_json(bool json, const std::function<int()>& action) {
  if (!json) {
    return action();
  }
  int code = kExitOk;
  std::string problem;
  bool has_result = false;
  {
    const KeptOutput errors(std::cerr);
    const KeptOutput results(std::cout);
    code = action();
    problem = errors.text();
    has_result = !results.text().empty();
  }
  if (code == kExitUsage) {
    print_usage_error(std::cout, problem);
  } else if (code == kExitFailed && !has_result && !problem.empty()) {
    print_failure(std::cout, problem);
  }
  return code;
}

}  // namespace

void FileCommands::add(CLI::App& app, const bool& json, const On& on) {
  add_plant(app, json, on);
  add_simulate(app, json, on);
  add_recording(app, json, on);
  add_replay(app, json, on);
  add_decode(app, json, on);
}

void FileCommands::add_plant(CLI::App& app, const bool& json, const On& on) {
  CLI::App* check = app.add_subcommand("check", "what a plant.yaml would run, and what is wrong");
  check->add_option("plant", plant_)->required();
  check->add_option("--against", running_,
                    "the plant.yaml that runs: what a reload would change, start and stop");
  on(check, [this, &json] {
    return running_.empty() ? gateway::check(plant_, json)
                            : gateway::check_reload(running_, plant_, json);
  });

  CLI::App* eds = app.add_subcommand(
      "eds", "print the EDS of a line's own node, or of LINE:DEVICE in the role device");
  eds->add_option("plant", plant_)->required();
  eds->add_option("line", line_)->required();
  on(eds, [this, &json] {
    return with_problems_as_json(
        json, [this] { return print_device_file(plant_, line_, DeviceFileKind::eds); });
  });

  CLI::App* dcf =
      app.add_subcommand("dcf", "print the DCF of a node, with all that is written to it");
  dcf->add_option("plant", plant_)->required();
  dcf->add_option("node", line_, "LINE:NODE")->required();
  dcf->add_flag("--concise", concise_, "concise DCF, as 1F22h holds it (binary)");
  on(dcf, [this, &json] {
    const auto kind = concise_ ? DeviceFileKind::concise : DeviceFileKind::dcf;
    return with_problems_as_json(json, [&] { return print_device_file(plant_, line_, kind); });
  });
}

void FileCommands::add_simulate(CLI::App& app, const bool& json, const On& on) {
  CLI::App* simulate = app.add_subcommand("simulate", "put simulated devices on an interface");
  simulate->add_option("interface", simulation_.uri, "e.g. socketcan:vcan0");
  simulate->add_option(
      "--device", simulation_.devices,
      "PROFILE:NODE, e.g. drive:5; drive:5:unconfigured is without a node-ID until LSS "
      "gives it one; repeatable");
  simulate->add_option("--plant", simulation_.plant, "all nodes of a line of this plant.yaml");
  simulate->add_option("--line", simulation_.line, "which line of the plant");
  simulate->add_option("--store", simulation_.storage,
                       "folder that keeps what is stored by 1010h, one file a device");
  on(simulate, [this, &json] {
    block_stop_signals();
    limit_end(kEndLimit);
    return with_problems_as_json(json, [this] { return gateway::simulate(simulation_); });
  });
}

void FileCommands::add_recording(CLI::App& app, const bool& json, const On& on) {
  CLI::App* record =
      app.add_subcommand("record", "write what is on an interface as candump log; sends nothing");
  record->add_option("interface", recording_.uri, "e.g. socketcan:can0")->required();
  record->add_option("-o,--output", recording_.file.file,
                     "file; the standard output if it is not given");
  record
      ->add_option("--max-size", recording_.file.max_size,
                   "bytes until the file is renamed to FILE.1, e.g. 100MB")
      ->transform(CLI::AsSizeValue(true))
      ->check(CLI::Range(1000.0, 1e12));
  record->add_option("--files", recording_.file.files, "files kept at most")
      ->check(CLI::Range(1, 10'000));
  on(record, [this, &json] {
    block_stop_signals();
    limit_end(kEndLimit);
    return with_problems_as_json(json, [this] { return gateway::record(recording_); });
  });
}

void FileCommands::add_replay(CLI::App& app, const bool& json, const On& on) {
  CLI::App* replay =
      app.add_subcommand("replay", "send the frames of a candump log on an interface");
  replay->add_option("log", replay_.file, "as candump -L or linegate record write it")->required();
  replay->add_option("interface", replay_.uri, "e.g. socketcan:vcan0")->required();
  replay->add_option("--speed", replay_.speed,
                     "times as fast as recorded, 0.1 to 1000, or max for as fast as possible");
  replay->add_option("--log-interface", replay_.log_interface,
                     "only the frames of this interface in the log");
  on(replay, [this, &json] {
    block_stop_signals();
    limit_end(kEndLimit);
    return with_problems_as_json(json, [this] { return gateway::replay(replay_); });
  });
}

void FileCommands::add_decode(CLI::App& app, const bool& json, const On& on) {
  CLI::App* decode = app.add_subcommand("decode", "explain a candump log line by line");
  decode
      ->add_option("log", decode_.file,
                   "as candump -L or linegate record write it; - is the standard input, live")
      ->required();
  decode->add_option("--plant", decode_.plant,
                     "names, objects and PDOs of the devices of this plant.yaml");
  decode->add_option("--line", decode_.line,
                     "which line of the plant; else the one on the interface the log names");
  on(decode, [this, &json] {
    decode_.json = json;
    return with_problems_as_json(json, [this] { return gateway::decode(decode_); });
  });
}

}  // namespace linegate::gateway
