// SPDX-License-Identifier: Apache-2.0
#include "bridges/sim/wave.h"

#include <cmath>
#include <numbers>

#include "stack/base/assert.h"

namespace linegate::sim {
namespace {

// 0 <= result < 1.
double fraction(std::uint64_t random) {
  return static_cast<double>(random >> 11U) * 0x1.0p-53;
}

}  // namespace

// The finaliser of SplitMix64.
std::uint64_t mix(std::uint64_t seed, std::uint64_t n) {
  std::uint64_t z = seed + (n + 1) * 0x9E37'79B9'7F4A'7C15ULL;
  z = (z ^ (z >> 30U)) * 0xBF58'476D'1CE4'E5B9ULL;
  z = (z ^ (z >> 27U)) * 0x94D0'49BB'1331'11EBULL;
  return z ^ (z >> 31U);
}

std::int64_t periods(Instant t, Duration period) {
  LINEGATE_ASSERT(period > Duration::zero(), "the period is positive");
  return t.time_since_epoch() / period;
}

Instant next_period(Instant t, Duration period) {
  return Instant((periods(t, period) + 1) * period);
}

double phase(Instant t, Duration period, std::uint64_t seed) {
  LINEGATE_ASSERT(period > Duration::zero(), "the period is positive");
  const Duration rest = t.time_since_epoch() % period;
  const double sum = static_cast<double>(rest.count()) / static_cast<double>(period.count()) +
                     fraction(mix(seed, 0));
  return sum - std::floor(sum);
}

double sine(Instant t, Duration period, std::uint64_t seed) {
  return std::sin(2 * std::numbers::pi * phase(t, period, seed));
}

double ramp(Instant t, Duration period, std::uint64_t seed) {
  return 2 * phase(t, period, seed) - 1;
}

double noise(Instant t, Duration period, std::uint64_t seed) {
  return 2 * fraction(mix(seed, static_cast<std::uint64_t>(periods(t, period)))) - 1;
}

}  // namespace linegate::sim
