// SPDX-License-Identifier: Apache-2.0
#include "gateway/tools/replay.h"

#include <array>
#include <cerrno>
#include <csignal>
#include <iostream>
#include <memory>
#include <utility>

#include <spdlog/spdlog.h>
#include <unistd.h>

#include "bridges/can/log_file.h"
#include "bridges/can/replay.h"
#include "gateway/runtime/channels.h"
#include "gateway/runtime/executor.h"
#include "gateway/runtime/exit_code.h"
#include "gateway/runtime/frame_pump.h"
#include "gateway/runtime/log.h"
#include "gateway/runtime/runner.h"
#include "gateway/runtime/signals.h"

namespace linegate::gateway {
namespace {

// Copies frames from a log to a channel. Frames that the channel does not accept are sent later, so
// a log that is replayed at maximum speed is limited by the bus.
class SendRunner final : public Runner {
 public:
  SendRunner(std::unique_ptr<can_bridge::Channel> log, std::unique_ptr<can_bridge::Channel> channel,
             std::string interface)
      : log_(std::move(log)), pump_(std::move(channel)), interface_(std::move(interface)) {}

  int descriptor() const override { return pump_.channel().descriptor(); }
  bool wants_writable() const override { return pump_.channel().wants_writable(); }
  void service(Instant now) override {
    pump_.drain(
        now, [](std::span<const can::Frame>) {},
        [this](const can::BusEvent& event) { bus_event(event); });
    if (ready_) {
      pump_.transmit(now, [&](can::Frame& frame) { return next(frame, now); });
    }
    if (at_end_ && pump_.held() == 0 && !std::exchange(reported_, true)) {
      ::kill(::getpid(), SIGTERM);
    }
  }
  Instant next_wake() const override {
    const Instant next = pump_.channel().next_wake();
    return ready_ && pump_.held() == 0 ? earlier(next, log_->next_wake()) : next;
  }
  void stop(Instant /*now*/) override { stopping_ = true; }
  bool stopped(Instant /*now*/) const override { return stopping_; }
  bool at_end() const { return at_end_; }

 private:
  bool next(can::Frame& frame, Instant now) {
    events_.clear();
    const bool given = !at_end_ && log_->read(std::span(&frame, 1), events_, now) == 1;
    for (const can::BusEvent& event : events_.view()) {
      at_end_ = at_end_ || event.kind == can::BusEvent::Kind::interface_failed;
    }
    return given;
  }

  void bus_event(const can::BusEvent& event) {
    if (event.kind == can::BusEvent::Kind::interface_ready) {
      spdlog::info("interface {} ready", interface_);
      ready_ = true;
    } else if (event.kind == can::BusEvent::Kind::interface_failed) {
      spdlog::error("{}", can_bridge::describe_failure(interface_, event.code));
    }
  }

  std::unique_ptr<can_bridge::Channel> log_;
  FramePump pump_;
  const std::string interface_;
  can_bridge::BusEvents events_;
  bool ready_ = false;
  bool at_end_ = false;
  bool reported_ = false;
  bool stopping_ = false;
};

void report_error(const std::string& text) {
  std::cerr << "error: " << text << '\n';
}

}  // namespace

int replay(const ReplayCommand& command) {
  std::string error;
  const config::Interface interface = config::parse_interface(command.uri, {}, error);
  can_bridge::InterfaceUri log{"replay", command.file, {{"speed", command.speed}}};
  if (!command.log_interface.empty()) {
    log.options.push_back({"interface", command.log_interface});
  }
  const auto options = can_bridge::replay_options(log);
  for (const std::string& problem : {error, options.error}) {
    if (!problem.empty()) {
      report_error(problem);
      return kExitUsage;
    }
  }
  const auto wrong = can_bridge::check_log(command.file, command.log_interface);
  print(wrong);
  if (has_errors(wrong)) {
    return kExitUsage;
  }
  set_up_log(config::LogLevel::info);
  sim::VirtualNetwork network;
  config::ExecutorPlan plan;
  plan.name = "replay";
  Executor executor(std::move(plan));
  auto runner = std::make_unique<SendRunner>(can_bridge::open_replay(command.file, options.options),
                                             open_channel(interface, 0, network), command.uri);
  const SendRunner& sender = *runner;
  executor.add(std::move(runner));
  executor.start();
  wait_for_stop_signal();
  executor.request_stop();
  executor.join();
  return sender.at_end() ? kExitOk : kExitFailed;
}

}  // namespace linegate::gateway
