// SPDX-License-Identifier: Apache-2.0
// The clocks of the host: the only place of the gateway that reads them.
#pragma once

#include <cstdint>

#include "stack/base/time.h"

namespace linegate::gateway {

// CLOCK_MONOTONIC.
Instant monotonic_now();

enum class ClockQuality : std::uint8_t {
  unknown,       // the host does not say
  free_running,  // the wall clock is not synchronised
  synchronised,  // synchronised to NTP, PTP or the like
};

// The wall clock as seen from the monotonic one: UTC = monotonic + offset.
struct ClockMap {
  Duration offset{};
  ClockQuality quality = ClockQuality::unknown;
};

// Measures where the wall clock is, and notices when it was stepped.
class WallClock {
 public:
  WallClock();

  // Looks at both clocks again. Gives by how much the wall clock was stepped since the last look
  // (positive: forward), 0 if it was merely adjusted.
  Duration refresh();

  const ClockMap& map() const { return map_; }

 private:
  ClockMap map_;
};

}  // namespace linegate::gateway
