// SPDX-License-Identifier: Apache-2.0
#include "stack/nmt/life_signs.h"

#include <gtest/gtest.h>

namespace linegate::nmt {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

constexpr std::uint8_t kLampNode = 5;

class LifeSignsTest : public ::testing::Test {
 protected:
  // The time until the node is no longer present.
  Duration held_from(Instant from) {
    for (Instant now = from;; now += milliseconds(1)) {
      if (life_.pop_expired(now) == kLampNode) {
        return now - from;
      }
      if (now > from + seconds(100)) {
        return Duration::max();
      }
    }
  }

  Instant now_{seconds(1)};
  LifeSigns life_;
};

TEST_F(LifeSignsTest, ABootUpMessageOrAnAnswerHoldsForATime) {
  life_.boot_up(kLampNode, now_);
  EXPECT_FALSE(life_.beats(kLampNode));
  EXPECT_EQ(held_from(now_), LifeSigns::kHold);
  EXPECT_EQ(life_.pop_expired(now_ + seconds(60)), 0) << "expires once";
  life_.answer(kLampNode, now_);
  EXPECT_EQ(held_from(now_), LifeSigns::kHold);
}

TEST_F(LifeSignsTest, HeartbeatsHoldForThreeOfTheTimesBetweenThem) {
  life_.heartbeat(kLampNode, now_);
  life_.heartbeat(kLampNode, now_ += milliseconds(700));
  EXPECT_TRUE(life_.beats(kLampNode));
  EXPECT_EQ(held_from(now_), milliseconds(2100));
  life_.heartbeat(kLampNode, now_ += milliseconds(700));
  life_.heartbeat(kLampNode, now_ += milliseconds(20));
  EXPECT_EQ(held_from(now_), milliseconds(700) * 3 / 4 * 3)
      << "the last heartbeat was a state change";
}

TEST_F(LifeSignsTest, ADoubledFrameTeachesNothingAndShortTimesHoldForASecond) {
  life_.heartbeat(kLampNode, now_);
  life_.heartbeat(kLampNode, now_ + milliseconds(1));
  EXPECT_EQ(held_from(now_), LifeSigns::kHold);
  life_.heartbeat(kLampNode, now_ += milliseconds(10));
  EXPECT_EQ(held_from(now_), LifeSigns::kShortest);
}

TEST_F(LifeSignsTest, ANodeThatIsMonitoredElsewhereDoesNotExpire) {
  life_.heartbeat(kLampNode, now_);
  life_.forget(kLampNode);
  EXPECT_EQ(held_from(now_), Duration::max());
  life_.expect(kLampNode, now_ + seconds(2));
  EXPECT_TRUE(life_.holds(kLampNode));
  EXPECT_EQ(life_.next_wake(), now_ + seconds(2));
  EXPECT_EQ(held_from(now_), seconds(2));
  EXPECT_FALSE(life_.holds(kLampNode));
}

}  // namespace
}  // namespace linegate::nmt
