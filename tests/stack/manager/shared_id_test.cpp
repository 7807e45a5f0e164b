// SPDX-License-Identifier: Apache-2.0
#include "stack/manager/shared_id.h"

#include <gtest/gtest.h>

namespace linegate::manager {
namespace {

using nmt::State;
using Evidence = SharedIds::Evidence;
using std::chrono::milliseconds;
using std::chrono::seconds;

class SharedIdsTest : public ::testing::Test {
 protected:
  Evidence after(int ms, State state = State::operational) {
    return ids_.heartbeat(5, state, now_ += milliseconds(ms));
  }
  // The first sign of a shared node-ID within `count` pairs of heartbeats.
  Evidence pairs(int count, int first, int second) {
    for (int i = 0; i < count; ++i) {
      for (const int ms : {first, second}) {
        if (const Evidence sign = after(ms); sign != Evidence::none) {
          return sign;
        }
      }
    }
    return Evidence::none;
  }

  Instant now_{seconds(1)};
  SharedIds ids_;
};

TEST_F(SharedIdsTest, TimesThatAlternateAreThoseOfTwoDevices) {
  EXPECT_EQ(pairs(10, 300, 700), Evidence::two_periods);
  EXPECT_EQ(pairs(10, 300, 700), Evidence::none) << "reported recently";
  now_ += SharedIds::kQuiet;
  EXPECT_EQ(pairs(10, 300, 700), Evidence::two_periods);
}

TEST_F(SharedIdsTest, OneDeviceMayVaryAndChangeItsPeriod) {
  EXPECT_EQ(pairs(50, 100, 100), Evidence::none);
  EXPECT_EQ(pairs(50, 97, 104), Evidence::none) << "the period varies";
  EXPECT_EQ(pairs(50, 50, 50), Evidence::none) << "1017h was written";
  EXPECT_EQ(pairs(50, 500, 500), Evidence::none);
}

// Found by random plants (210000658): at 125 kbit/s other frames delayed every second heartbeat.
TEST_F(SharedIdsTest, HeartbeatsThatABusyBusDelaysAreThoseOfOneDevice) {
  EXPECT_EQ(pairs(3, 50, 51), Evidence::none);
  EXPECT_EQ(pairs(20, 66, 34), Evidence::none) << "their average is the period of before";
  EXPECT_EQ(pairs(20, 34, 17), Evidence::two_periods) << "their average is half of it";
}

TEST_F(SharedIdsTest, TimesThatAlternateAroundTheProducerTimeAreThoseOfOneDevice) {
  const auto sign_of = [this](Duration first, Duration second) {
    Evidence sign = Evidence::none;
    for (int i = 0; i < 20 && sign == Evidence::none; ++i) {
      sign = ids_.heartbeat(5, State::operational, now_ += i % 2 == 0 ? first : second,
                            milliseconds(51));
    }
    return sign;
  };
  EXPECT_EQ(sign_of(milliseconds(67), milliseconds(35)), Evidence::none);
  ids_.begin(5);
  EXPECT_EQ(sign_of(milliseconds(31), milliseconds(20)), Evidence::two_periods);
}

TEST_F(SharedIdsTest, AHeartbeatBesidesIsNoSecondDevice) {
  for (int i = 0; i < 20; ++i) {
    EXPECT_EQ(after(100), Evidence::none);
    EXPECT_EQ(after(100), Evidence::none);
    EXPECT_EQ(after(30), Evidence::none);
    EXPECT_EQ(after(70), Evidence::none);
    EXPECT_EQ(after(1), Evidence::none) << "a repeated frame";
  }
}

// A write of 1017h to that node-ID reaches both devices.
TEST_F(SharedIdsTest, HeartbeatsThatAreEachRepeatedAreThoseOfTwoDevices) {
  const auto sign_of = [this](Duration period, Duration apart, Duration producer, int times) {
    Evidence sign = Evidence::none;
    for (int i = 0; i < times && sign == Evidence::none; ++i) {
      sign = ids_.heartbeat(5, State::operational, now_ += period - apart, producer);
      const Evidence second = ids_.heartbeat(5, State::operational, now_ += apart, producer);
      sign = sign != Evidence::none ? sign : second;
    }
    return sign;
  };
  const auto few = std::chrono::microseconds(300);
  EXPECT_EQ(sign_of(milliseconds(500), few, {}, 7), Evidence::none);
  EXPECT_EQ(sign_of(milliseconds(500), few, {}, 1), Evidence::two_periods);
  EXPECT_EQ(sign_of(milliseconds(500), few, {}, 20), Evidence::none) << "reported recently";
  now_ += SharedIds::kQuiet;
  EXPECT_EQ(sign_of(milliseconds(500), milliseconds(3), {}, 20), Evidence::none)
      << "maybe one device";
  EXPECT_EQ(sign_of(milliseconds(500), milliseconds(3), milliseconds(500), 20),
            Evidence::two_periods);
}

TEST_F(SharedIdsTest, AShortPeriodOrBatchesAreNoPairs) {
  for (const int period : {2, 3, 4}) {
    for (int i = 0; i < 50; ++i) {
      now_ += milliseconds(period);
      EXPECT_EQ(ids_.heartbeat(5, State::operational, now_, milliseconds(period)), Evidence::none);
      EXPECT_EQ(ids_.heartbeat(6, State::operational, now_), Evidence::none);
    }
  }
  for (int i = 0; i < 50; ++i) {
    now_ += milliseconds(200);
    EXPECT_EQ(ids_.heartbeat(7, State::operational, now_, milliseconds(100)), Evidence::none);
    EXPECT_EQ(ids_.heartbeat(7, State::operational, now_, milliseconds(100)), Evidence::none)
        << "in a batch";
  }
}

TEST_F(SharedIdsTest, StatesThatAlternateWithoutACommandAreThoseOfTwoDevices) {
  after(100, State::operational);
  EXPECT_EQ(after(100, State::pre_operational), Evidence::none);
  EXPECT_EQ(after(100, State::operational), Evidence::none);
  EXPECT_EQ(after(100, State::pre_operational), Evidence::none);
  EXPECT_EQ(after(100, State::operational), Evidence::two_states);
}

TEST_F(SharedIdsTest, TwiceAsManyHeartbeatsAsTheProducerTimeAllowsAreThoseOfTwoDevices) {
  const auto sign_of = [this](int period, int times) {
    Evidence sign = Evidence::none;
    for (int i = 0; i < times && sign == Evidence::none; ++i) {
      now_ += milliseconds(period);
      sign = ids_.heartbeat(5, State::operational, now_, milliseconds(400));
    }
    return sign;
  };
  EXPECT_EQ(sign_of(400, 50), Evidence::none);
  EXPECT_EQ(sign_of(360, 50), Evidence::none) << "within the clock tolerance";
  EXPECT_EQ(sign_of(200, 4), Evidence::none) << "too few heartbeats";
  EXPECT_EQ(sign_of(200, 4), Evidence::too_many_heartbeats);
  EXPECT_EQ(sign_of(200, 50), Evidence::none) << "reported recently";
  now_ += SharedIds::kQuiet;
  EXPECT_EQ(sign_of(200, 20), Evidence::too_many_heartbeats);
}

TEST_F(SharedIdsTest, AProducerTimeThatIsNotKnownAllowsAll) {
  EXPECT_EQ(pairs(50, 400, 400), Evidence::none);
  EXPECT_EQ(pairs(50, 200, 200), Evidence::none);
}

TEST_F(SharedIdsTest, AProducerTimeThatWasWrittenCountsFromThenOn) {
  const auto with = [this](int producer, int period) {
    now_ += milliseconds(period);
    return ids_.heartbeat(5, State::operational, now_, milliseconds(producer));
  };
  for (int i = 0; i < 20; ++i) {
    EXPECT_EQ(with(100, 100), Evidence::none);
  }
  for (int i = 0; i < 20; ++i) {
    EXPECT_EQ(with(400, 400), Evidence::none) << "earlier changes are permitted";
  }
}

TEST_F(SharedIdsTest, HeartbeatsThatGoOnAfterABootUpMessageAreThoseOfAnotherDevice) {
  pairs(5, 200, 200);
  ids_.boot_up(5, now_ + milliseconds(80));
  EXPECT_EQ(after(200), Evidence::none) << "the heartbeat may have been under way";
  EXPECT_EQ(after(200), Evidence::unchanged_after_boot_up);
}

TEST_F(SharedIdsTest, ADeviceThatStartsByItselfIsNoSecondOne) {
  for (const int boots_after : {1, 80, 199}) {
    pairs(5, 200, 200);
    now_ += milliseconds(boots_after);
    ids_.boot_up(5, now_);
    for (int i = 0; i < 10; ++i) {
      EXPECT_EQ(after(200), Evidence::none) << boots_after;
    }
  }
}

TEST_F(SharedIdsTest, ADeviceThatIsStartedAfterItsBootIsNoSecondOne) {
  pairs(5, 200, 200);
  ids_.boot_up(5, now_ + milliseconds(80));
  ids_.begin(5);
  EXPECT_EQ(after(200), Evidence::none);
  EXPECT_EQ(after(200), Evidence::none);
  ids_.boot_up(5, now_ += milliseconds(80));
  ids_.boot_up(5, now_ += milliseconds(20));
  EXPECT_EQ(after(100, State::pre_operational), Evidence::none);
  EXPECT_EQ(after(200, State::pre_operational), Evidence::none);
}

TEST_F(SharedIdsTest, CommandsAndBootUpMessagesBeginAnew) {
  for (int i = 0; i < 20; ++i) {
    ids_.begin(i % 2 == 0 ? 5 : 0);
    EXPECT_EQ(after(300, i % 2 == 0 ? State::operational : State::pre_operational), Evidence::none);
    EXPECT_EQ(after(700, i % 2 == 0 ? State::operational : State::pre_operational), Evidence::none);
  }
}

}  // namespace
}  // namespace linegate::manager
