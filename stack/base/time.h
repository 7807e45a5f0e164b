// SPDX-License-Identifier: Apache-2.0
// Protocol time: an instant on the monotonic clock of the host, in nanoseconds.
//
// The stack never reads a clock. LineClock has no now(): the caller that drives a line (an
// executor, a test in virtual time) passes the time in, so that the same frames at the same
// instants always have the same result. Wall-clock time is used only where samples are published.
#pragma once

#include <chrono>
#include <cstdint>

#include "stack/base/assert.h"

namespace linegate {

using Duration = std::chrono::nanoseconds;

struct LineClock {
  using rep = Duration::rep;
  using period = Duration::period;
  using duration = Duration;
  using time_point = std::chrono::time_point<LineClock, Duration>;
  static constexpr bool is_steady = true;
};

// A point on the monotonic clock.
using Instant = LineClock::time_point;

// The wake-up time of an object without a pending time-out.
inline constexpr Instant kNever = Instant::max();

constexpr Instant earlier(Instant a, Instant b) {
  return a < b ? a : b;
}

// The deadline for a time-out that a client chose: now + timeout, or kNever if that is not
// representable. Precondition: now >= 0, timeout >= 0.
constexpr Instant deadline(Instant now, Duration timeout) {
  LINEGATE_ASSERT(now >= Instant{} && timeout >= Duration::zero(), "time is not negative");
  return timeout < kNever - now ? now + timeout : kNever;
}

// The next due time of cyclic work that was due at `due`, without drift and without bursts: the
// first instant after `now` that is a whole number of periods after `due`. Missed periods are
// skipped. Precondition: period > 0.
constexpr Instant next_after(Instant due, Duration period, Instant now) {
  LINEGATE_ASSERT(period > Duration::zero(), "the period is positive");
  const Instant next = due + period;
  return next > now ? next : next + ((now - next) / period + 1) * period;
}

}  // namespace linegate
