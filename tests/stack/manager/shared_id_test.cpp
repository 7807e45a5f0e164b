// SPDX-License-Identifier: Apache-2.0
#include "stack/manager/shared_id.h"

#include <gtest/gtest.h>

namespace linegate::manager {
namespace {

using nmt::State;
using std::chrono::milliseconds;
using std::chrono::seconds;

class SharedIdsTest : public ::testing::Test {
 protected:
  std::uint32_t after(int ms, State state = State::operational) {
    return ids_.heartbeat(5, state, now_ += milliseconds(ms));
  }
  // The first sign of a shared node-ID within `count` pairs of heartbeats.
  std::uint32_t pairs(int count, int first, int second) {
    for (int i = 0; i < count; ++i) {
      for (const int ms : {first, second}) {
        if (const std::uint32_t sign = after(ms); sign != 0) {
          return sign;
        }
      }
    }
    return 0;
  }

  Instant now_{seconds(1)};
  SharedIds ids_;
};

TEST_F(SharedIdsTest, TimesThatAlternateAreThoseOfTwoDevices) {
  EXPECT_EQ(pairs(10, 300, 700), kTwoRhythms);
  EXPECT_EQ(pairs(10, 300, 700), 0U) << "reported recently";
  now_ += SharedIds::kQuiet;
  EXPECT_EQ(pairs(10, 300, 700), kTwoRhythms);
}

TEST_F(SharedIdsTest, OneDeviceMayVaryAndChangeItsPeriod) {
  EXPECT_EQ(pairs(50, 100, 100), 0U);
  EXPECT_EQ(pairs(50, 97, 104), 0U) << "the period varies";
  EXPECT_EQ(pairs(50, 50, 50), 0U) << "1017h was written";
  EXPECT_EQ(pairs(50, 500, 500), 0U);
}

TEST_F(SharedIdsTest, AHeartbeatBesidesIsNoSecondDevice) {
  for (int i = 0; i < 20; ++i) {
    EXPECT_EQ(after(100), 0U);
    EXPECT_EQ(after(100), 0U);
    EXPECT_EQ(after(30), 0U);
    EXPECT_EQ(after(70), 0U);
    EXPECT_EQ(after(1), 0U) << "a repeated frame";
  }
}

// A write of 1017h to that node-ID reaches both devices.
TEST_F(SharedIdsTest, HeartbeatsThatAreEachRepeatedAreThoseOfTwoDevices) {
  const auto sign_of = [this](Duration period, Duration apart, Duration producer, int times) {
    std::uint32_t sign = 0;
    for (int i = 0; i < times && sign == 0; ++i) {
      sign = ids_.heartbeat(5, State::operational, now_ += period - apart, producer);
      const std::uint32_t second = ids_.heartbeat(5, State::operational, now_ += apart, producer);
      sign = sign != 0 ? sign : second;
    }
    return sign;
  };
  const auto few = std::chrono::microseconds(300);
  EXPECT_EQ(sign_of(milliseconds(500), few, {}, 7), 0U);
  EXPECT_EQ(sign_of(milliseconds(500), few, {}, 1), kTwoRhythms);
  EXPECT_EQ(sign_of(milliseconds(500), few, {}, 20), 0U) << "reported recently";
  now_ += SharedIds::kQuiet;
  EXPECT_EQ(sign_of(milliseconds(500), milliseconds(3), {}, 20), 0U) << "maybe one device";
  EXPECT_EQ(sign_of(milliseconds(500), milliseconds(3), milliseconds(500), 20), kTwoRhythms);
}

TEST_F(SharedIdsTest, AShortPeriodOrBatchesAreNoPairs) {
  for (const int period : {2, 3, 4}) {
    for (int i = 0; i < 50; ++i) {
      now_ += milliseconds(period);
      EXPECT_EQ(ids_.heartbeat(5, State::operational, now_, milliseconds(period)), 0U);
      EXPECT_EQ(ids_.heartbeat(6, State::operational, now_), 0U);
    }
  }
  for (int i = 0; i < 50; ++i) {
    now_ += milliseconds(200);
    EXPECT_EQ(ids_.heartbeat(7, State::operational, now_, milliseconds(100)), 0U);
    EXPECT_EQ(ids_.heartbeat(7, State::operational, now_, milliseconds(100)), 0U) << "in a batch";
  }
}

TEST_F(SharedIdsTest, StatesThatAlternateWithoutACommandAreThoseOfTwoDevices) {
  after(100, State::operational);
  EXPECT_EQ(after(100, State::pre_operational), 0U);
  EXPECT_EQ(after(100, State::operational), 0U);
  EXPECT_EQ(after(100, State::pre_operational), 0U);
  EXPECT_EQ(after(100, State::operational), kTwoStates);
}

TEST_F(SharedIdsTest, TwiceAsManyHeartbeatsAsTheProducerTimeAllowsAreThoseOfTwoDevices) {
  const auto sign_of = [this](int period, int times) {
    std::uint32_t sign = 0;
    for (int i = 0; i < times && sign == 0; ++i) {
      now_ += milliseconds(period);
      sign = ids_.heartbeat(5, State::operational, now_, milliseconds(400));
    }
    return sign;
  };
  EXPECT_EQ(sign_of(400, 50), 0U);
  EXPECT_EQ(sign_of(360, 50), 0U) << "within the clock tolerance";
  EXPECT_EQ(sign_of(200, 4), 0U) << "too few heartbeats";
  EXPECT_EQ(sign_of(200, 4), kTooManyHeartbeats);
  EXPECT_EQ(sign_of(200, 50), 0U) << "reported recently";
  now_ += SharedIds::kQuiet;
  EXPECT_EQ(sign_of(200, 20), kTooManyHeartbeats);
}

TEST_F(SharedIdsTest, AProducerTimeThatIsNotKnownAllowsAll) {
  EXPECT_EQ(pairs(50, 400, 400), 0U);
  EXPECT_EQ(pairs(50, 200, 200), 0U);
}

TEST_F(SharedIdsTest, AProducerTimeThatWasWrittenCountsFromThenOn) {
  const auto with = [this](int producer, int period) {
    now_ += milliseconds(period);
    return ids_.heartbeat(5, State::operational, now_, milliseconds(producer));
  };
  for (int i = 0; i < 20; ++i) {
    EXPECT_EQ(with(100, 100), 0U);
  }
  for (int i = 0; i < 20; ++i) {
    EXPECT_EQ(with(400, 400), 0U) << "earlier changes are permitted";
  }
}

TEST_F(SharedIdsTest, HeartbeatsThatGoOnAfterABootUpMessageAreThoseOfAnotherDevice) {
  pairs(5, 200, 200);
  ids_.boot_up(5, now_ + milliseconds(80));
  EXPECT_EQ(after(200), 0U) << "the heartbeat may have been under way";
  EXPECT_EQ(after(200), kBootedBeside);
}

TEST_F(SharedIdsTest, ADeviceThatStartsByItselfIsNoSecondOne) {
  for (const int boots_after : {1, 80, 199}) {
    pairs(5, 200, 200);
    now_ += milliseconds(boots_after);
    ids_.boot_up(5, now_);
    for (int i = 0; i < 10; ++i) {
      EXPECT_EQ(after(200), 0U) << boots_after;
    }
  }
}

TEST_F(SharedIdsTest, ADeviceThatIsStartedAfterItsBootIsNoSecondOne) {
  pairs(5, 200, 200);
  ids_.boot_up(5, now_ + milliseconds(80));
  ids_.begin(5);
  EXPECT_EQ(after(200), 0U);
  EXPECT_EQ(after(200), 0U);
  ids_.boot_up(5, now_ += milliseconds(80));
  ids_.boot_up(5, now_ += milliseconds(20));
  EXPECT_EQ(after(100, State::pre_operational), 0U);
  EXPECT_EQ(after(200, State::pre_operational), 0U);
}

TEST_F(SharedIdsTest, CommandsAndBootUpMessagesBeginAnew) {
  for (int i = 0; i < 20; ++i) {
    ids_.begin(i % 2 == 0 ? 5 : 0);
    EXPECT_EQ(after(300, i % 2 == 0 ? State::operational : State::pre_operational), 0U);
    EXPECT_EQ(after(700, i % 2 == 0 ? State::operational : State::pre_operational), 0U);
  }
}

}  // namespace
}  // namespace linegate::manager
