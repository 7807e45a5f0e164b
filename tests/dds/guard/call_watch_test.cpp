// SPDX-License-Identifier: Apache-2.0
#include "bridges/dds/guard/call_watch.h"

#include <list>
#include <optional>

#include <gtest/gtest.h>

namespace linegate::dds::guard {
namespace {

TEST(CallWatch, TheOldestPresentCallCounts) {
  CallWatch watch;
  EXPECT_EQ(watch.longest(1'000), 0);
  std::optional<CallWatch::Call> first(std::in_place, watch, 100);
  const CallWatch::Call second(watch, 300);
  EXPECT_EQ(watch.longest(1'000), 900);
  first.reset();
  EXPECT_EQ(watch.longest(1'000), 700);
}

TEST(CallWatch, TheThreadOfTheOldestCallIsKnown) {
  CallWatch watch;
  EXPECT_EQ(watch.thread_of_longest(1'000), 0);
  const CallWatch::Call first(watch, 300, 17);
  const CallWatch::Call second(watch, 100, 18);
  EXPECT_EQ(watch.thread_of_longest(1'000), 18);
}

TEST(CallWatch, WhatIsExpectedIsNoStall) {
  CallWatch watch;
  const CallWatch::Call call(watch, 100);
  watch.expect(100, 500);
  watch.expect(200, 300);
  EXPECT_EQ(watch.longest(900), 0);
  EXPECT_EQ(watch.longest(1'000), 100);
  EXPECT_EQ(watch.overdue(1'000), 100);
  watch.expect(1'000, CallWatch::kMostExpected);
  watch.expect(1'000, CallWatch::kMostExpected);
  EXPECT_EQ(watch.longest(1'001 + CallWatch::kMostExpected), 1);
}

TEST(CallWatch, ACallWithoutAPlaceIsNotWatchedAndDisturbsNone) {
  CallWatch watch;
  {
    std::list<CallWatch::Call> calls;
    calls.emplace_back(watch, 50);
    for (std::size_t i = 1; i <= CallWatch::kCalls; ++i) {
      calls.emplace_back(watch, 40 + static_cast<std::int64_t>(i));
    }
    EXPECT_EQ(watch.longest(100), 59);
  }
  EXPECT_EQ(watch.longest(100), 0);
}

}  // namespace
}  // namespace linegate::dds::guard
