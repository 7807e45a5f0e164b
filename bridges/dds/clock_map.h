// SPDX-License-Identifier: Apache-2.0
// From protocol time to published time and back.
#pragma once

#include <cstdint>

#include "stack/base/time.h"

namespace linegate::dds {

// How good a published time is. The numbers are those of the DDS contract.
enum class ClockQuality : std::uint8_t {
  unknown,       // the host does not tell
  free_running,  // the host's clock is not synchronised
  synchronised,  // synchronised to NTP, PTP or the like
};

// The wall clock as seen from the monotonic one: UTC = monotonic + offset. A plain value, measured
// by the gateway; a step of the wall clock is a new map.
struct ClockMap {
  Duration offset{};
  ClockQuality quality = ClockQuality::unknown;

  // UTC in nanoseconds since 1970-01-01; 0 stays 0 (never).
  constexpr std::int64_t utc(Instant instant) const {
    return instant == Instant{} ? 0 : (instant.time_since_epoch() + offset).count();
  }
  constexpr Instant instant(std::int64_t utc) const {
    return utc == 0 ? Instant{} : Instant{Duration{utc} - offset};
  }
};

}  // namespace linegate::dds
