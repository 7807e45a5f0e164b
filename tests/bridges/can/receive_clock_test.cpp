// SPDX-License-Identifier: Apache-2.0
#include "bridges/can/receive_clock.h"

#include <gtest/gtest.h>

namespace linegate::can_bridge {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

// Wall clock when the monotonic clock is 0.
constexpr std::int64_t kWall = 1'800'000'000'000'000'000;

constexpr Instant at(std::int64_t ms) {
  return Instant(milliseconds(ms));
}
constexpr std::int64_t wall(std::int64_t ms, std::int64_t step_ms = 0) {
  return kWall + (ms + step_ms) * 1'000'000;
}

TEST(ReceiveClock, StampIsAsOldAsTheWallClockSays) {
  ReceiveClock clock;
  clock.begin_batch(at(1000), wall(1000));
  EXPECT_EQ(clock.instant(wall(995)), at(995));
  EXPECT_EQ(clock.instant(wall(998)), at(998));
}

TEST(ReceiveClock, NeverLaterThanTheSamplingAndNeverBackwards) {
  ReceiveClock clock;
  clock.begin_batch(at(1000), wall(1000));
  EXPECT_EQ(clock.instant(wall(1000) + 500'000), at(1000));
  EXPECT_EQ(clock.instant(wall(990)), at(1000));
  clock.begin_batch(at(1011), wall(1011));
  EXPECT_EQ(clock.instant(wall(1005)), at(1005));
}

TEST(ReceiveClock, FrameWithoutStampIsOfTheSampling) {
  ReceiveClock clock;
  clock.begin_batch(at(1000), wall(1000));
  EXPECT_EQ(clock.instant(0), at(1000));
}

class Step : public testing::TestWithParam<std::int64_t> {};

TEST_P(Step, StampsBeforeAndAfterTheStepAreRight) {
  const std::int64_t step = GetParam();
  ReceiveClock clock;
  clock.begin_batch(at(1000), wall(1000));
  clock.instant(wall(999));
  clock.begin_batch(at(1100), wall(1100, step));
  EXPECT_EQ(clock.instant(wall(1040)), at(1040));
  EXPECT_EQ(clock.instant(wall(1095, step)), at(1095));
  clock.begin_batch(at(1200), wall(1200, step));
  EXPECT_EQ(clock.instant(wall(1150, step)), at(1150));
}

INSTANTIATE_TEST_SUITE_P(ForwardAndBack, Step,
                         testing::Values(2'000, -2'000, 7'200'000, -7'200'000));

TEST(ReceiveClock, LateThreadStillGetsTheTrueTimes) {
  ReceiveClock clock;
  clock.begin_batch(at(0), wall(0));
  clock.begin_batch(at(60'000), wall(60'000));
  EXPECT_EQ(clock.instant(wall(30'000)), at(30'000));
}

}  // namespace
}  // namespace linegate::can_bridge
