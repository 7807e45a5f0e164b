// SPDX-License-Identifier: Apache-2.0
// Protocol time: an instant on the monotonic clock of the host, in nanoseconds.
//
// The stack never reads a clock. LineClock has no now(): whoever drives a line (an executor, a test
// in virtual time) passes the time in, so the same frames at the same instants always give the same
// result. Wall-clock time exists only at the edge, where samples are published.
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

// The wake-up time of something that waits for no time-out.
inline constexpr Instant kNever = Instant::max();

constexpr Instant earlier(Instant a, Instant b) {
  return a < b ? a : b;
}

// A deadline from a time-out that a client chose: now + timeout; kNever if that lies beyond the end
// of time. Precondition: now >= 0, timeout >= 0.
constexpr Instant deadline(Instant now, Duration timeout) {
  LINEGATE_ASSERT(now >= Instant{} && timeout >= Duration::zero(), "time is not negative");
  return timeout < kNever - now ? now + timeout : kNever;
}

// For cyclic work that neither drifts nor bursts: when work that was due at `due` is due next: one
// period later. Periods that have passed by `now` are left out, so that a late caller does not make
// up for them all at once; the result lies on the grid of `due` and after `now`. Precondition:
// period > 0.
constexpr Instant next_after(Instant due, Duration period, Instant now) {
  LINEGATE_ASSERT(period > Duration::zero(), "the period is positive");
  const Instant next = due + period;
  return next > now ? next : next + ((now - next) / period + 1) * period;
}

}  // namespace linegate
