// SPDX-License-Identifier: Apache-2.0
// Values that move: functions of time and seed alone, the same on every run.
#pragma once

#include <cstdint>

#include "stack/base/time.h"

namespace linegate::sim {

// A number that looks random, from two numbers.
std::uint64_t mix(std::uint64_t seed, std::uint64_t n);

// How many whole periods have passed at t. Precondition: period > 0.
std::int64_t periods(Instant t, Duration period);
// The beginning of the next period after t.
Instant next_period(Instant t, Duration period);

// Where in its period t is, 0 <= result < 1; the seed shifts it.
double phase(Instant t, Duration period, std::uint64_t seed);
// sin(2 pi phase): -1..1.
double sine(Instant t, Duration period, std::uint64_t seed);
// 2 phase - 1: rises from -1 to 1 and falls back at once.
double ramp(Instant t, Duration period, std::uint64_t seed);
// A new number in -1..1 in each period.
double noise(Instant t, Duration period, std::uint64_t seed);

}  // namespace linegate::sim
