// SPDX-License-Identifier: Apache-2.0
// Protocol time: an instant on the monotonic clock of the host, in nanoseconds.
//
// The stack never reads a clock. LineClock has no now(): whoever drives a line (an executor, a test
// in virtual time) passes the time in, so the same frames at the same instants always give the same
// result. Wall-clock time exists only at the edge, where samples are published.
#pragma once

#include <chrono>
#include <cstdint>

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

}  // namespace linegate
