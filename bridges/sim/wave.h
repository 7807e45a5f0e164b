// SPDX-License-Identifier: Apache-2.0
// Moving values: functions of time and seed alone, identical in every run.
#pragma once

#include <cstdint>

#include "stack/base/time.h"

namespace linegate::sim {

// A pseudo-random number from two numbers.
std::uint64_t mix(std::uint64_t seed, std::uint64_t n);

// Number of whole periods up to t. Precondition: period > 0.
std::int64_t periods(Instant t, Duration period);
// The start of the first period after t.
Instant next_period(Instant t, Duration period);

// The position of t in its period, 0 <= result < 1, shifted by the seed.
double phase(Instant t, Duration period, std::uint64_t seed);
// sin(2 pi phase): -1..1.
double sine(Instant t, Duration period, std::uint64_t seed);
// 2 phase - 1: rises from -1 to 1, then falls back.
double ramp(Instant t, Duration period, std::uint64_t seed);
// A pseudo-random number in -1..1 for each period.
double noise(Instant t, Duration period, std::uint64_t seed);

}  // namespace linegate::sim
