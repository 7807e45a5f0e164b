// SPDX-License-Identifier: Apache-2.0
#include "gateway/tools/record.h"

#include <cerrno>
#include <csignal>
#include <cstring>
#include <iostream>
#include <memory>
#include <utility>

#include <spdlog/spdlog.h>
#include <unistd.h>

#include "gateway/runtime/channels.h"
#include "gateway/runtime/executor.h"
#include "gateway/runtime/exit_code.h"
#include "gateway/runtime/frame_pump.h"
#include "gateway/runtime/log.h"
#include "gateway/runtime/record_file.h"
#include "gateway/runtime/recorder.h"
#include "gateway/runtime/runner.h"
#include "gateway/runtime/signals.h"

namespace linegate::gateway {
namespace {

// Reads a channel and sends nothing; the channel records the frames itself.
class ListenRunner final : public Runner {
 public:
  ListenRunner(std::unique_ptr<can_bridge::Channel> channel, std::string interface)
      : pump_(std::move(channel)), interface_(std::move(interface)) {}

  int descriptor() const override { return pump_.channel().descriptor(); }
  bool wants_writable() const override { return false; }
  void service(Instant now) override {
    pump_.drain(
        now, [](std::span<const can::Frame>) {},
        [this](const can::BusEvent& event) { bus_event(event); });
    next_wake_ = pump_.more() ? now : pump_.channel().next_wake();
  }
  Instant next_wake() const override { return next_wake_; }
  void stop(Instant /*now*/) override { stopping_ = true; }
  bool stopped(Instant /*now*/) const override { return stopping_; }

 private:
  void bus_event(const can::BusEvent& event) {
    if (event.kind == can::BusEvent::Kind::interface_ready) {
      spdlog::info("interface {} ready", interface_);
    } else if (event.kind == can::BusEvent::Kind::interface_failed && event.code == ENODATA) {
      ::kill(::getpid(), SIGTERM);  // the end of a replay ends the recording
    } else if (event.kind == can::BusEvent::Kind::interface_failed) {
      spdlog::error("{}", can_bridge::describe_failure(interface_, event.code));
    }
  }

  FramePump pump_;
  const std::string interface_;
  Instant next_wake_{};
  bool stopping_ = false;
};

// Returns the exit code; an error is printed.
int report(const Recording::Outcome& outcome, const std::string& file) {
  if (outcome.error == 0 && outcome.missing == 0) {
    return kExitOk;
  }
  std::cerr << "error: " << (file.empty() ? "standard output" : file) << ": ";
  if (outcome.error != 0) {
    std::cerr << "the recording stopped: " << std::strerror(outcome.error) << "; ";
  }
  std::cerr << "frames that are missing: " << outcome.missing << '\n';
  return kExitFailed;
}

}  // namespace

int record(const RecordOptions& options) {
  std::string error;
  const config::Interface interface = config::parse_interface(options.uri, {}, error);
  if (!error.empty()) {
    std::cerr << "error: " << error << '\n';
    return kExitUsage;
  }
  if (const int failed = RecordFile(options.file).append({}); failed != 0) {
    std::cerr << "error: " << options.file.file << ": cannot be written: " << std::strerror(failed)
              << '\n';
    return kExitFailed;
  }
  set_up_log(config::LogLevel::info);  // not to standard output, where the frames may be written
  sim::VirtualNetwork network;
  Recorder recorder;
  Recording& recording = recorder.add(options.uri, name_in_log(interface, "can0"), options.file);
  config::ExecutorPlan plan;
  plan.name = "record";
  Executor executor(std::move(plan));
  executor.add(std::make_unique<ListenRunner>(
      std::make_unique<RecordingChannel>(open_channel(interface, 0, network, Use::observe),
                                         recording),
      options.uri));
  recorder.start();
  executor.start();
  wait_for_stop_signal();
  executor.request_stop();
  executor.join();
  recorder.stop();
  return report(recording.outcome(), options.file.file);
}

}  // namespace linegate::gateway
