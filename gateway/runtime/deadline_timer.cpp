// SPDX-License-Identifier: Apache-2.0
#include "gateway/runtime/deadline_timer.h"

#include <cerrno>
#include <chrono>
#include <ctime>
#include <system_error>

#include <sys/timerfd.h>
#include <unistd.h>

namespace linegate::gateway {

DeadlineTimer::DeadlineTimer()
    : descriptor_(timerfd_create(CLOCK_MONOTONIC, TFD_NONBLOCK | TFD_CLOEXEC)) {
  if (descriptor_ < 0) {
    throw std::system_error(errno, std::generic_category(), "timerfd_create");
  }
}

DeadlineTimer::~DeadlineTimer() {
  close(descriptor_);
}

void DeadlineTimer::set(Instant until) {
  const Duration time = until.time_since_epoch();
  const auto seconds = std::chrono::floor<std::chrono::seconds>(time);
  itimerspec due{};
  due.it_value = {static_cast<std::time_t>(seconds.count()),
                  static_cast<long>((time - seconds).count())};
  timerfd_settime(descriptor_, TFD_TIMER_ABSTIME, &due, nullptr);
  set_to_ = until;
}

}  // namespace linegate::gateway
