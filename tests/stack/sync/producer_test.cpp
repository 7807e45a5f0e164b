// SPDX-License-Identifier: Apache-2.0
#include "stack/sync/producer.h"

#include <gtest/gtest.h>

#include "tests/stack/node/objects.h"

namespace linegate::sync {
namespace {

using namespace std::chrono_literals;
using testing::at;
using testing::data_of;
using testing::pop_frames;

class SyncProducerTest : public ::testing::Test {
 protected:
  void run(Duration period, std::uint8_t overflow = 0, std::uint32_t cob_id = 0x4000'0080) {
    producer.set_active(true);
    producer.configure({true, can::CobId{cob_id}, period, overflow});
    producer.apply_writes(at(0ms));
  }

  std::vector<can::Frame> frames_at(Duration when) {
    producer.advance(at(when));
    return pop_frames(queue);
  }

  can::TransmitQueue queue;
  Producer producer{queue};
};

TEST_F(SyncProducerTest, AFrameWithoutDataEveryPeriod) {  // 1006h
  run(10ms);
  EXPECT_TRUE(frames_at(9ms).empty());
  const auto frames = frames_at(10ms);
  ASSERT_EQ(frames.size(), 1U);
  EXPECT_EQ(frames[0].id, 0x80U);
  EXPECT_EQ(frames[0].length, 0);
  EXPECT_TRUE(frames_at(19ms).empty());
  EXPECT_EQ(frames_at(20ms).size(), 1U);
}

TEST_F(SyncProducerTest, TheCounterRunsFromOneToItsOverflowValue) {  // 1019h
  run(10ms, 3);
  std::vector<int> seen;
  for (int i = 1; i <= 7; ++i) {
    const auto counter = producer.advance(at(i * 10ms));
    const auto frames = pop_frames(queue);
    ASSERT_EQ(frames.size(), 1U);
    EXPECT_EQ(data_of(frames[0]), std::vector<int>{counter.value_or(0)});
    seen.push_back(*counter);
  }
  EXPECT_EQ(seen, (std::vector<int>{1, 2, 3, 1, 2, 3, 1}));
}

TEST_F(SyncProducerTest, TheCounterStartsOverAfterStopped) {
  run(10ms, 10);
  frames_at(10ms);
  frames_at(20ms);
  producer.set_active(false);
  EXPECT_EQ(producer.next_wake(), kNever);
  EXPECT_TRUE(frames_at(100ms).empty());
  producer.set_active(true);
  producer.apply_writes(at(100ms));
  const auto frames = frames_at(110ms);
  ASSERT_EQ(frames.size(), 1U);
  EXPECT_EQ(data_of(frames[0]), (std::vector<int>{1}));
}

TEST_F(SyncProducerTest, ThePeriodDoesNotDrift) {
  run(10ms);
  frames_at(13ms);
  EXPECT_EQ(producer.next_wake(), at(20ms));
}

TEST_F(SyncProducerTest, ALateProducerSkips) {
  run(10ms);
  EXPECT_EQ(frames_at(47ms).size(), 1U);
  EXPECT_EQ(producer.next_wake(), at(50ms));
}

TEST_F(SyncProducerTest, LateByExactlyAPeriodSkipsToo) {
  run(10ms);
  EXPECT_EQ(frames_at(20ms).size(), 1U);
  EXPECT_EQ(producer.next_wake(), at(30ms));
}

TEST_F(SyncProducerTest, DoesNotPileUpBehindABlockedBus) {
  run(10ms, 10);
  EXPECT_TRUE(producer.advance(at(10ms)));
  EXPECT_FALSE(producer.advance(at(20ms)));
  EXPECT_FALSE(producer.advance(at(30ms)));
  EXPECT_EQ(pop_frames(queue).size(), 1U);
  const auto counter = producer.advance(at(40ms));
  ASSERT_TRUE(counter);
  EXPECT_EQ(*counter, 2);
}

TEST_F(SyncProducerTest, NothingWithoutBitOrPeriod) {
  run(10ms, 0, 0x0000'0080);
  EXPECT_EQ(producer.next_wake(), kNever);
  run(0ms);
  EXPECT_EQ(producer.next_wake(), kNever);
  EXPECT_TRUE(frames_at(10s).empty());
}

TEST_F(SyncProducerTest, NothingBeforeItIsConfigured) {
  producer.apply_writes(at(0ms));
  EXPECT_TRUE(frames_at(10s).empty());
  EXPECT_EQ(producer.next_wake(), kNever);
}

TEST_F(SyncProducerTest, TwentyNineBits) {
  run(10ms, 0, 0x6000'0801);
  const auto frames = frames_at(10ms);
  ASSERT_EQ(frames.size(), 1U);
  EXPECT_EQ(frames[0].id, 0x801U);
  EXPECT_TRUE(frames[0].extended());
}

TEST_F(SyncProducerTest, AChangeStartsAnewWithTheNextTime) {
  run(10ms);
  producer.configure({true, can::CobId{0x4000'0080}, 4ms, 0});
  EXPECT_LE(producer.next_wake(), at(7ms));
  producer.apply_writes(at(7ms));
  EXPECT_EQ(producer.next_wake(), at(11ms));
}

}  // namespace
}  // namespace linegate::sync
