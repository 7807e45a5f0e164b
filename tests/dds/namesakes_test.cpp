// SPDX-License-Identifier: Apache-2.0
// Which participants count as another gateway of the same name.
#include "bridges/dds/namesakes.h"

#include <chrono>

#include <gtest/gtest.h>

namespace linegate::dds {
namespace {

using namespace std::chrono_literals;

TEST(Namesakes, CountOnceTheyAreThereForLongerThanTheirLease) {
  Namesakes<int> others;  // participants are identified by a number
  others.come(1, Instant{10s}, 5s);
  EXPECT_EQ(others.count(Instant{14s}), 0U) << "it may have been killed: its lease has not expired";
  others.come(1, Instant{14s}, 5s);  // announced again with a change
  EXPECT_EQ(others.count(Instant{15s}), 1U);
  others.come(2, Instant{15s}, Duration::max());
  EXPECT_EQ(others.count(Instant{1h}), 1U);
  others.go(1);
  others.go(3);
  EXPECT_EQ(others.count(Instant{1h}), 0U);
}

}  // namespace
}  // namespace linegate::dds
