#include "gateway/signals.h"

#include <algorithm>
#include <csignal>
#include <ctime>
#include <initializer_list>

#include <pthread.h>

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

void block(std::initializer_list<int> signals) {
  const sigset_t set = set_of(signals);
  pthread_sigmask(SIG_BLOCK, &set, nullptr);
}

}  // namespace

void block_stop_signals() {
  block({SIGINT, SIGTERM});
}

void block_reload_signal() {
  block({SIGHUP});
}

int wait_for_stop_signal() {
  const sigset_t set = set_of({SIGINT, SIGTERM});
  int signal = 0;
  while (sigwait(&set, &signal) != 0) {
  }
  return signal;
}

std::optional<int> wait_for_signal(Duration timeout) {
  const sigset_t set = set_of({SIGINT, SIGTERM, SIGHUP});
  const Duration left = std::max(timeout, Duration::zero());
  const auto seconds = std::chrono::floor<std::chrono::seconds>(left);
  const timespec ts{static_cast<std::time_t>(seconds.count()),
                    static_cast<long>((left - seconds).count())};
  const int signal = sigtimedwait(&set, nullptr, &ts);
  return signal > 0 ? std::optional(signal) : std::nullopt;
}

}  // namespace linegate::gateway
