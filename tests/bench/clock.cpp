// SPDX-License-Identifier: Apache-2.0
#include "tests/bench/clock.h"

#include <chrono>
#include <thread>

#include <pthread.h>

namespace linegate::bench {

std::int64_t read_clock(clockid_t clock) {
  timespec time{};
  clock_gettime(clock, &time);
  return std::int64_t{time.tv_sec} * 1'000'000'000 + time.tv_nsec;
}

void sleep_until(std::int64_t time) {
  const timespec at{time / 1'000'000'000, static_cast<long>(time % 1'000'000'000)};
  clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &at, nullptr);
}

void ThreadClock::begin() {
  pthread_getcpuclockid(pthread_self(), &clock_);
  begun_.store(true);
}

void ThreadClock::wait_begun() const {
  while (!begun_.load()) {
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
}

std::int64_t ThreadClock::now() const {
  wait_begun();
  return read_clock(clock_);
}

}  // namespace linegate::bench
