// SPDX-License-Identifier: Apache-2.0
#include "bridges/sim/wave.h"

#include <cmath>

#include <gtest/gtest.h>

namespace linegate::sim {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

TEST(Wave, SameSeedAndTimeGiveTheSameValue) {
  for (int ms = 0; ms < 5000; ms += 37) {
    const Instant t{milliseconds(ms)};
    EXPECT_EQ(sine(t, seconds(3), 9), sine(t, seconds(3), 9));
    EXPECT_LE(std::abs(sine(t, seconds(3), 9)), 1.0);
    EXPECT_LE(std::abs(ramp(t, seconds(3), 9)), 1.0);
    EXPECT_LE(std::abs(noise(t, milliseconds(50), 9)), 1.0);
    EXPECT_NEAR(phase(t, seconds(3), 9), phase(t + seconds(3), seconds(3), 9), 1e-9);
  }
  EXPECT_NE(phase(Instant{}, seconds(3), 1), phase(Instant{}, seconds(3), 2));
}

TEST(Wave, NoiseStaysForAPeriodAndThenChanges) {
  EXPECT_EQ(noise(Instant{milliseconds(100)}, milliseconds(100), 1),
            noise(Instant{milliseconds(199)}, milliseconds(100), 1));
  EXPECT_NE(noise(Instant{milliseconds(199)}, milliseconds(100), 1),
            noise(Instant{milliseconds(200)}, milliseconds(100), 1));
}

TEST(Wave, NextPeriodIsLaterAndOnTheGrid) {
  EXPECT_EQ(next_period(Instant{milliseconds(0)}, milliseconds(10)), Instant{milliseconds(10)});
  EXPECT_EQ(next_period(Instant{milliseconds(9)}, milliseconds(10)), Instant{milliseconds(10)});
  EXPECT_EQ(next_period(Instant{milliseconds(10)}, milliseconds(10)), Instant{milliseconds(20)});
}

}  // namespace
}  // namespace linegate::sim
