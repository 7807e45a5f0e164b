// SPDX-License-Identifier: Apache-2.0
#include "gateway/runtime/deadline_timer.h"

#include <chrono>

#include <gtest/gtest.h>
#include <poll.h>

#include "gateway/runtime/clock.h"

namespace linegate::gateway {
namespace {

using namespace std::chrono_literals;

constexpr int kLongEnough = 10'000;  // ms; a test that waits so long has failed

class DeadlineTimerTest : public testing::Test {
 protected:
  Instant wake_in(Duration time) {
    const Instant now = monotonic_now();
    timer_.wake_at(now + time, now);
    return now + time;
  }
  bool is_readable(int within) {
    pollfd p{timer_.descriptor(), POLLIN, 0};
    return poll(&p, 1, within) == 1;
  }

  DeadlineTimer timer_;
};

TEST_F(DeadlineTimerTest, WakesNotBeforeItsDeadlineAndIsQuietAgain) {
  EXPECT_FALSE(is_readable(0));
  const Instant due = wake_in(20ms);
  EXPECT_TRUE(is_readable(kLongEnough));
  EXPECT_GE(monotonic_now(), due);
  wake_in(1h);
  EXPECT_FALSE(is_readable(0));
}

TEST_F(DeadlineTimerTest, AnEarlierDeadlineCountsAndALaterOneWaitsForIt) {
  wake_in(1h);
  EXPECT_FALSE(is_readable(0));
  const Instant due = wake_in(20ms);
  wake_in(1h);
  EXPECT_TRUE(is_readable(kLongEnough)) << "the earlier time counts";
  EXPECT_GE(monotonic_now(), due);
  wake_in(1h);
  EXPECT_FALSE(is_readable(0));
}

}  // namespace
}  // namespace linegate::gateway
