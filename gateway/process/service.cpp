// SPDX-License-Identifier: Apache-2.0
#include "gateway/process/service.h"

#include <csignal>
#include <utility>

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include "gateway/process/status_text.h"
#include "gateway/runtime/clock.h"
#include "gateway/runtime/log.h"
#include "gateway/runtime/signals.h"

namespace linegate::gateway {
namespace {

constexpr Duration kStartPeriod = std::chrono::milliseconds(20);
constexpr Duration kStatusTextPeriod = std::chrono::seconds(1);
// Without a watchdog, stuck threads are only logged.
constexpr Duration kUnwatchedLook = std::chrono::seconds(5);

Duration look_period(Duration watchdog) {
  return watchdog > Duration::zero() ? watchdog / 2 : kUnwatchedLook;
}

}  // namespace

Service::Service(Gateway& gateway, std::function<Background::Rest()> reload)
    : gateway_(gateway),
      reload_(std::move(reload)),
      look_period_(look_period(manager_.watchdog())),
      watch_(gateway.threads()) {
}

int Service::run() {
  gateway_.start();
  int signal = 0;
  while (signal == 0) {
    work(monotonic_now());
    signal = wait();
  }
  manager_.stopping();
  spdlog::info("stopping on signal {}", signal);
  gateway_.stop();
  return signal;
}

int Service::wait() {
  const Instant next = earlier(look_due_, status_due_);
  const bool soon = !ready_ || reading_.active();
  const Duration left = soon ? kStartPeriod : next - monotonic_now();
  const auto signal = wait_for_signal(left);
  if (!signal) {
    return 0;
  }
  if (signal->number != SIGHUP) {
    return signal->number;
  }
  if (reading_.active()) {
    read_again_ = true;
    next_sender_ = signal->sender;
  } else {
    begin_reload(signal->sender);
  }
  return 0;
}

void Service::begin_reload(const std::optional<SignalSender>& sender) {
  gateway_.set_reload_sender(sender);
  manager_.reloading();
  reading_.start(reload_);
}

// SIGINT and SIGTERM also end the service while files are read, however long that takes.
void Service::finish_reload() {
  const auto rest = reading_.finished();
  if (!rest) {
    return;
  }
  (*rest)();
  watch_ = ProgressWatch(gateway_.threads());
  ready_ = false;
  if (std::exchange(read_again_, false)) {
    begin_reload(next_sender_);
  }
}

void Service::work(Instant now) {
  if (!ready_ && watch_.all_started()) {
    ready_ = true;
    manager_.ready();
    spdlog::info("ready");
  }
  apply_scans();
  finish_reload();
  gateway_.report_journal();
  gateway_.report_edge();
  if (now >= look_due_) {
    look_due_ = now + look_period_;
    look();
  }
  if (now >= status_due_) {
    status_due_ = now + kStatusTextPeriod;
    show_status();
  }
}

void Service::apply_scans() {
  const auto said = gateway_.apply_scans();
  if (!said) {
    return;
  }
  log(*said);
  watch_ = ProgressWatch(gateway_.threads());
  ready_ = false;
}

void Service::look() {
  std::vector<std::string> stuck = watch_.look();
  if (stuck.empty()) {
    manager_.alive();
    if (!stuck_.empty()) {
      spdlog::warn("all threads make progress again");
    }
  } else if (stuck != stuck_) {
    const auto ms = std::chrono::duration_cast<std::chrono::milliseconds>(look_period_).count();
    spdlog::error("no progress within {} ms: {}", ms, fmt::join(stuck, ", "));
  }
  if (stuck != stuck_) {
    stuck_ = std::move(stuck);
    show_status();
  }
}

void Service::show_status() {
  std::vector<std::string> complaints = gateway_.edge_conditions();
  if (!stuck_.empty()) {
    complaints.insert(complaints.begin(), fmt::format("no progress: {}", fmt::join(stuck_, ", ")));
  }
  std::string status = status_text(gateway_.shown_lines(), complaints);
  if (status != status_) {
    manager_.status(status);
    status_ = std::move(status);
  }
}

}  // namespace linegate::gateway
