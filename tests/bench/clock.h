// SPDX-License-Identifier: Apache-2.0
// Clocks of the kernel in ns, and periodic waiting.
#pragma once

#include <atomic>
#include <cstdint>

#include <time.h>

namespace linegate::bench {

// Reads CLOCK_MONOTONIC, CLOCK_THREAD_CPUTIME_ID, or a clock from pthread_getcpuclockid(), in ns.
std::int64_t read_clock(clockid_t clock);

// Sleeps until that time of CLOCK_MONOTONIC, in ns.
void sleep_until(std::int64_t time);

// The CPU time of one thread, for other threads to read.
class ThreadClock {
 public:
  // Called by the thread itself.
  void begin();
  // Waits until the thread has called begin().
  void wait_begun() const;
  // CPU time of the thread since its start, in ns. Waits until it has called begin().
  std::int64_t now() const;

 private:
  clockid_t clock_{};
  std::atomic<bool> begun_{false};
};

// Wakes every `period` ns, counted from its construction: a late call does not delay the later
// ones.
class Pacer {
 public:
  explicit Pacer(std::int64_t period) : period_(period), next_(read_clock(CLOCK_MONOTONIC)) {}

  void wait() { sleep_until(next_ += period_); }

 private:
  std::int64_t period_;
  std::int64_t next_;
};

}  // namespace linegate::bench
