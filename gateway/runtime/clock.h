// SPDX-License-Identifier: Apache-2.0
// The clocks of the host. No other part of the gateway reads them.
#pragma once

#include <cstdint>

#include "stack/base/time.h"

namespace linegate::gateway {

// CLOCK_MONOTONIC.
Instant monotonic_now();

enum class ClockQuality : std::uint8_t {
  unknown,       // the host does not report it
  free_running,  // the wall clock is not synchronised
  synchronised,  // synchronised to NTP, PTP or a similar source
};

// The relation of the wall clock to the monotonic clock: UTC = monotonic + offset.
struct ClockMap {
  Duration offset{};
  ClockQuality quality = ClockQuality::unknown;
};

// Measures the offset of the wall clock, and detects steps.
class WallClock {
 public:
  WallClock();

  // Reads both clocks again. Returns by how much the wall clock was stepped since the last call
  // (positive: forward), 0 if it was only slewed.
  Duration refresh();

  const ClockMap& map() const { return map_; }

 private:
  ClockMap map_;
};

}  // namespace linegate::gateway
