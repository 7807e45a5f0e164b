// SPDX-License-Identifier: Apache-2.0
#include "stack/sync/consumer.h"

#include <gtest/gtest.h>

#include "tests/stack/node/objects.h"

namespace linegate::sync {
namespace {

using namespace std::chrono_literals;
using testing::at;
using testing::frame_at;
using testing::pop_events;

class SyncConsumerTest : public ::testing::Test {
 protected:
  void run(Duration period = 0ms, std::uint8_t overflow = 0, std::uint32_t cob_id = 0x80) {
    consumer.configure({true, can::CobId{cob_id}, period, overflow});
    consumer.set_active(true);
  }

  Reception hear(Duration when, std::initializer_list<std::uint8_t> data = {}) {
    return consumer.receive(frame_at(at(when), 0x80, data));
  }

  can::Dispatch dispatch;
  EventLog events;
  Consumer consumer{dispatch, events};
};

TEST_F(SyncConsumerTest, TakesASyncWithoutCounter) {
  run();
  const Reception got = hear(0ms);
  EXPECT_TRUE(got.is_sync);
  EXPECT_EQ(got.counter, 0);
  EXPECT_FALSE(got.wrong_length);
}

TEST_F(SyncConsumerTest, TakesTheCounter) {
  run(0ms, 10);
  const Reception got = hear(0ms, {7});
  EXPECT_TRUE(got.is_sync);
  EXPECT_EQ(got.counter, 7);
  EXPECT_FALSE(got.wrong_length);
}

TEST_F(SyncConsumerTest, ACounterThatDoesNotFitTheConfigurationIsToldAndLeftOut) {
  run();
  const Reception with = hear(0ms, {7});
  EXPECT_TRUE(with.is_sync);
  EXPECT_TRUE(with.wrong_length);
  EXPECT_EQ(with.counter, 0);
  run(0ms, 10);
  const Reception without = hear(0ms);
  EXPECT_TRUE(without.is_sync);
  EXPECT_TRUE(without.wrong_length);
  EXPECT_EQ(without.counter, 0);
}

TEST_F(SyncConsumerTest, LongerFramesAreNoSync) {
  run(0ms, 10);
  const Reception got = hear(0ms, {1, 2});
  EXPECT_FALSE(got.is_sync);
  EXPECT_TRUE(got.wrong_length);
}

TEST_F(SyncConsumerTest, TheErrorBeginsOncePerStreak) {
  run();
  EXPECT_TRUE(hear(0ms, {1}).error_begins);
  EXPECT_FALSE(hear(1ms, {1}).error_begins);
  EXPECT_FALSE(hear(2ms).error_begins);
  EXPECT_TRUE(hear(3ms, {1, 2, 3}).error_begins);
}

TEST_F(SyncConsumerTest, ExpectingStartsWithASync) {
  run(10ms);
  EXPECT_EQ(consumer.next_wake(), kNever);
  hear(100ms);
  EXPECT_EQ(consumer.next_wake(), at(115ms));
}

TEST_F(SyncConsumerTest, LostAfterOneAndAHalfPeriodsOnce) {
  run(10ms);
  hear(0ms);
  consumer.advance(at(14ms));
  EXPECT_TRUE(events.empty());
  consumer.advance(at(40ms));
  const auto told = pop_events(events);
  ASSERT_EQ(told.size(), 1U);
  EXPECT_EQ(told[0].time, at(15ms));
  EXPECT_EQ(told[0].data, EventData(event::SyncLost{10ms}));
  consumer.advance(at(1s));
  EXPECT_TRUE(events.empty());
}

TEST_F(SyncConsumerTest, ALateSyncTellsTheLossItself) {
  run(10ms);
  hear(0ms);
  hear(16ms);
  const auto told = pop_events(events);
  ASSERT_EQ(told.size(), 1U);
  EXPECT_EQ(told[0].time, at(15ms));
  EXPECT_EQ(consumer.next_wake(), at(31ms));
}

TEST_F(SyncConsumerTest, NothingIsExpectedWithoutPeriodOrWhileInactive) {
  run();
  hear(0ms);
  EXPECT_EQ(consumer.next_wake(), kNever);
  run(10ms);
  hear(0ms);
  consumer.set_active(false);
  EXPECT_EQ(consumer.next_wake(), kNever);
  EXPECT_FALSE(hear(5ms).is_sync);
}

TEST_F(SyncConsumerTest, AProducerDoesNotConsume) {
  run(10ms, 0, 0x4000'0080);
  EXPECT_EQ(dispatch.find(frame_at(at(0ms), 0x80, {})), nullptr);
  EXPECT_FALSE(hear(0ms).is_sync);
}

TEST_F(SyncConsumerTest, WhileSuspendedNoneIsMissed) {
  run(100ms);
  EXPECT_TRUE(hear(0ms).is_sync);
  consumer.set_suspended(true);
  consumer.advance(at(1s));
  EXPECT_TRUE(hear(1s).is_sync) << "it counts";
  EXPECT_EQ(consumer.next_wake(), kNever);
  consumer.advance(at(10s));
  EXPECT_TRUE(pop_events(events).empty());
  consumer.set_suspended(false);
  EXPECT_TRUE(hear(10s).is_sync);
  consumer.advance(at(11s));
  EXPECT_EQ(pop_events(events).size(), 1U);
}

}  // namespace
}  // namespace linegate::sync
