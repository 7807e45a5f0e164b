// SPDX-License-Identifier: Apache-2.0
#include "stack/pdo/timers.h"

#include <gtest/gtest.h>

#include "tests/stack/pdo/devices.h"

namespace linegate::pdo {
namespace {

using test::at;

TEST(Timers, FireInTheOrderOfTheirTimes) {
  Timers timers;
  timers.reset(3);
  EXPECT_EQ(timers.next(), kNever);
  timers.set(0, at(30));
  timers.set(1, at(10));
  timers.set(2, at(20));
  EXPECT_EQ(timers.next(), at(10));
  EXPECT_FALSE(timers.pop_due(at(9)));
  EXPECT_EQ(timers.pop_due(at(25)), 1U);
  EXPECT_EQ(timers.pop_due(at(25)), 2U);
  EXPECT_FALSE(timers.pop_due(at(25)));
  EXPECT_EQ(timers.pop_due(at(30)), 0U);
  EXPECT_EQ(timers.next(), kNever);
}

TEST(Timers, CanBeMovedBothWaysAndStopped) {
  Timers timers;
  timers.reset(2);
  timers.set(0, at(10));
  timers.set(0, at(40));
  EXPECT_FALSE(timers.pop_due(at(39)));
  EXPECT_EQ(timers.next(), at(40));
  timers.set(0, at(5));
  EXPECT_EQ(timers.next(), at(5));
  timers.set(1, at(7));
  timers.stop(0);
  EXPECT_EQ(timers.pop_due(at(50)), 1U);
  EXPECT_FALSE(timers.pop_due(at(50)));
}

}  // namespace
}  // namespace linegate::pdo
