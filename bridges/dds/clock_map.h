// SPDX-License-Identifier: Apache-2.0
// Converts between protocol time and published time.
#pragma once

#include <cstdint>

#include "stack/base/time.h"

namespace linegate::dds {

// Quality of a published time. The numbers are those of the DDS contract.
enum class ClockQuality : std::uint8_t {
  unknown,       // the host does not report it
  free_running,  // the host's clock is not synchronised
  synchronised,  // synchronised to NTP, PTP or the like
};

// The wall clock relative to the monotonic clock: UTC = monotonic + offset. A plain value, measured
// by the gateway; a step of the wall clock results in a new map.
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
