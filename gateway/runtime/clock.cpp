// SPDX-License-Identifier: Apache-2.0
#include "gateway/runtime/clock.h"

#include <ctime>

#include <sys/timex.h>

namespace linegate::gateway {
namespace {

// Slewing moves the clock by at most 0.5 ms a second; a step is much larger.
constexpr Duration kStep = std::chrono::milliseconds(10);

Duration read_clock(clockid_t id) {
  timespec ts{};
  clock_gettime(id, &ts);
  return std::chrono::seconds(ts.tv_sec) + Duration(ts.tv_nsec);
}

// The offset of the pair of readings that preemption disturbed least.
Duration measure_offset() {
  Duration best_span = Duration::max();
  Duration offset{};
  for (int i = 0; i < 3; ++i) {
    const Duration before = read_clock(CLOCK_MONOTONIC);
    const Duration wall = read_clock(CLOCK_REALTIME);
    const Duration after = read_clock(CLOCK_MONOTONIC);
    if (after - before < best_span) {
      best_span = after - before;
      offset = wall - before - best_span / 2;
    }
  }
  return offset;
}

ClockQuality measure_quality() {
  timex tx{};
  const int state = adjtimex(&tx);
  if (state < 0) {
    return ClockQuality::unknown;
  }
  const bool unsynchronised = state == TIME_ERROR || (tx.status & STA_UNSYNC) != 0;
  return unsynchronised ? ClockQuality::free_running : ClockQuality::synchronised;
}

}  // namespace

[[gnu::hot]] Instant monotonic_now() {
  return Instant(read_clock(CLOCK_MONOTONIC));
}

WallClock::WallClock() : map_{measure_offset(), measure_quality()} {
}

Duration WallClock::refresh() {
  const Duration before = map_.offset;
  map_ = {measure_offset(), measure_quality()};
  const Duration moved = map_.offset - before;
  return moved > kStep || moved < -kStep ? moved : Duration::zero();
}

}  // namespace linegate::gateway
