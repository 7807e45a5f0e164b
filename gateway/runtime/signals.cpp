// SPDX-License-Identifier: Apache-2.0
#include "gateway/runtime/signals.h"

#include <algorithm>
#include <chrono>
#include <csignal>
#include <ctime>
#include <initializer_list>
#include <string>
#include <string_view>
#include <thread>

#include <pthread.h>
#include <unistd.h>

#include "gateway/exchange/cell.h"
#include "gateway/runtime/exit_code.h"

namespace linegate::gateway {
namespace {

sigset_t set_of(std::initializer_list<int> signals) {
  sigset_t set;
  sigemptyset(&set);
  for (const int signal : signals) {
    sigaddset(&set, signal);
  }
  return set;
}

constexpr unsigned kCaughtLimit = 4;  // seconds

volatile std::sig_atomic_t stop_caught = 0;

void catch_stop(int /*signal*/) {
  stop_caught = 1;
  ::alarm(kCaughtLimit);
}

void end_by_force(int /*signal*/) {
  constexpr std::string_view kMessage =
      "a thread did not end in time: the process ends without it\n";
  (void)!::write(STDERR_FILENO, kMessage.data(), kMessage.size());
  ::_exit(kExitForced);
}

// Time until a stop signal that no thread waits for is detected.
constexpr std::chrono::milliseconds kLookPeriod{200};

// Set when wait_for_signal() or wait_for_stop_signal() has taken a stop signal. Never destroyed:
// the thread of limit_end() runs until the process ends.
exchange::Flag& stop_taken() {
  static auto* const flag = new exchange::Flag;
  return *flag;
}

int note(int signal) {
  if (signal == SIGINT || signal == SIGTERM) {
    stop_taken().raise();
  }
  return signal;
}

[[noreturn]] void end_after(Duration limit, const std::string& message) {
  pthread_setname_np(pthread_self(), "end");
  while (!stop_taken().raised() && !stop_signal_pending()) {
    std::this_thread::sleep_for(kLookPeriod);
  }
  std::this_thread::sleep_for(limit - kLookPeriod);
  // write(), because another thread may hold the locks of the log or of stdio
  (void)!::write(STDERR_FILENO, message.data(), message.size());
  ::_exit(kExitForced);
}

void block(std::initializer_list<int> signals) {
  const sigset_t set = set_of(signals);
  pthread_sigmask(SIG_BLOCK, &set, nullptr);
}

}  // namespace

void block_stop_signals() {
  block({SIGINT, SIGTERM});
}

void limit_end(Duration limit) {
  const auto ms = std::chrono::duration_cast<std::chrono::milliseconds>(limit).count();
  stop_taken();
  std::thread(end_after, limit,
              "a thread did not end within " + std::to_string(ms) +
                  " ms after the stop signal: the process ends without it\n")
      .detach();
}

void block_reload_signal() {
  block({SIGHUP});
}

void catch_stop_signals() {
  std::signal(SIGALRM, end_by_force);
  std::signal(SIGINT, catch_stop);
  std::signal(SIGTERM, catch_stop);
}

TimeToEnd::TimeToEnd(std::chrono::seconds limit) {
  std::signal(SIGALRM, end_by_force);
  const unsigned earlier = ::alarm(static_cast<unsigned>(limit.count()));
  if (earlier != 0 && earlier < static_cast<unsigned>(limit.count()))
    ::alarm(earlier);
}

TimeToEnd::~TimeToEnd() {
  ::alarm(0);
}

bool stop_signal_caught() {
  return stop_caught != 0;
}

// A signal that no thread takes stays pending.
bool stop_signal_pending() {
  sigset_t pending;
  sigemptyset(&pending);
  sigpending(&pending);
  return sigismember(&pending, SIGINT) == 1 || sigismember(&pending, SIGTERM) == 1;
}

int wait_for_stop_signal() {
  const sigset_t set = set_of({SIGINT, SIGTERM});
  int signal = 0;
  while (sigwait(&set, &signal) != 0) {
  }
  return note(signal);
}

std::optional<ReceivedSignal> wait_for_signal(Duration timeout) {
  const sigset_t set = set_of({SIGINT, SIGTERM, SIGHUP});
  const Duration left = std::max(timeout, Duration::zero());
  const auto seconds = std::chrono::floor<std::chrono::seconds>(left);
  const timespec ts{static_cast<std::time_t>(seconds.count()),
                    static_cast<long>((left - seconds).count())};
  siginfo_t info{};
  const int signal = sigtimedwait(&set, &info, &ts);
  if (signal <= 0) {
    return std::nullopt;
  }
  ReceivedSignal out{.number = note(signal)};
  if (info.si_code == SI_USER || info.si_code == SI_QUEUE || info.si_code == SI_TKILL) {
    out.sender = SignalSender{info.si_pid, info.si_uid};
  }
  return out;
}

}  // namespace linegate::gateway
