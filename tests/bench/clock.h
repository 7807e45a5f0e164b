// SPDX-License-Identifier: Apache-2.0
// Clocks of the kernel in ns, and pauses of equal length.
#pragma once

#include <atomic>
#include <cstdint>

#include <time.h>

namespace linegate::bench {

// ns of CLOCK_MONOTONIC, CLOCK_THREAD_CPUTIME_ID, or of a clock that pthread_getcpuclockid() gave.
std::int64_t read_clock(clockid_t clock);

// Sleeps until that time of CLOCK_MONOTONIC, in ns.
void sleep_until(std::int64_t time);

// CPU time of one thread, read by others.
class ThreadClock {
 public:
  // By the thread itself.
  void begin();
  // Waits until it has begun.
  void wait_begun() const;
  // CPU time of the thread since its start, in ns; waits until it has begun.
  std::int64_t now() const;

 private:
  clockid_t clock_{};
  std::atomic<bool> begun_{false};
};

// Every `period` ns, counted from when it was made: a late caller does not move the times after.
class Pacer {
 public:
  explicit Pacer(std::int64_t period) : period_(period), next_(read_clock(CLOCK_MONOTONIC)) {}

  void wait() { sleep_until(next_ += period_); }

 private:
  std::int64_t period_;
  std::int64_t next_;
};

}  // namespace linegate::bench
