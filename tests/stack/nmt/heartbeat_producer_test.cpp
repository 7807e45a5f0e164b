// SPDX-License-Identifier: Apache-2.0
#include "stack/nmt/heartbeat_producer.h"

#include <gtest/gtest.h>

#include "stack/od/objects.h"

#include "tests/stack/node/objects.h"

namespace linegate::nmt {
namespace {

using namespace std::chrono_literals;
using testing::at;
using testing::data_of;
using testing::pop_frames;

class HeartbeatProducerTest : public ::testing::Test {
 protected:
  explicit HeartbeatProducerTest(std::uint16_t ms = 100)
      : dictionary(testing::dictionary_of(
            {testing::object(od::objects::kProducerHeartbeatTime, od::DataType::unsigned16, ms)})),
        producer(dictionary, queue, 5) {
    EXPECT_TRUE(dictionary.set_hook(od::objects::kProducerHeartbeatTime, &producer).ok());
  }

  void boot() {
    producer.boot_up(at(0ms));
    producer.set_state(State::pre_operational);
    pop_frames(queue);
  }

  std::size_t frames_at(Instant now) {
    producer.advance(now);
    return pop_frames(queue).size();
  }

  od::Dictionary dictionary;
  can::TransmitQueue queue;
  HeartbeatProducer producer;
};

TEST_F(HeartbeatProducerTest, BootUpIsOneZeroByteAndTheFirstHeartbeat) {
  producer.boot_up(at(0ms));
  const auto frames = pop_frames(queue);
  ASSERT_EQ(frames.size(), 1U);
  EXPECT_EQ(frames[0].id, 0x705U);
  EXPECT_EQ(data_of(frames[0]), (std::vector<int>{0x00}));
  EXPECT_EQ(producer.next_wake(), at(100ms));
}

TEST_F(HeartbeatProducerTest, ShowsTheState) {
  boot();
  const std::pair<State, int> table[] = {
      {State::pre_operational, 0x7F}, {State::operational, 0x05}, {State::stopped, 0x04}};
  auto time = at(0ms);
  for (const auto& [state, byte] : table) {
    producer.set_state(state);
    time += 100ms;
    producer.advance(time);
    const auto frames = pop_frames(queue);
    ASSERT_EQ(frames.size(), 1U);
    EXPECT_EQ(data_of(frames[0]), (std::vector<int>{byte}));
  }
}

TEST_F(HeartbeatProducerTest, ThePeriodDoesNotDrift) {
  boot();
  EXPECT_EQ(frames_at(at(99ms)), 0U);
  EXPECT_EQ(frames_at(at(107ms)), 1U);
  EXPECT_EQ(producer.next_wake(), at(200ms));
}

TEST_F(HeartbeatProducerTest, ALateProducerDoesNotBurst) {
  boot();
  EXPECT_EQ(frames_at(at(450ms)), 1U);
  EXPECT_EQ(producer.next_wake(), at(500ms));
  EXPECT_EQ(frames_at(at(450ms)), 0U);
}

TEST_F(HeartbeatProducerTest, DoesNotPileUpBehindABlockedBus) {
  boot();
  for (int i = 1; i <= 50; ++i) {
    producer.advance(at(i * 100ms));
  }
  EXPECT_EQ(pop_frames(queue).size(), 1U);
}

TEST_F(HeartbeatProducerTest, AWriteStartsAtOnce) {
  boot();
  EXPECT_EQ(testing::write<std::uint16_t>(dictionary, {0x1017, 0}, 30), AbortCode::none);
  EXPECT_LE(producer.next_wake(), at(50ms));
  producer.apply_writes(at(50ms));
  EXPECT_EQ(pop_frames(queue).size(), 1U);
  EXPECT_EQ(producer.next_wake(), at(80ms));
  EXPECT_EQ(frames_at(at(80ms)), 1U);
}

TEST_F(HeartbeatProducerTest, ZeroStops) {
  boot();
  EXPECT_EQ(testing::write<std::uint16_t>(dictionary, {0x1017, 0}, 0), AbortCode::none);
  EXPECT_EQ(producer.next_wake(), kNever);
  EXPECT_EQ(frames_at(at(10s)), 0U);
}

TEST_F(HeartbeatProducerTest, SettleRunsNoTimeOut) {
  boot();
  producer.apply_writes(at(500ms));
  EXPECT_TRUE(queue.empty());
}

class SilentHeartbeatProducerTest : public HeartbeatProducerTest {
 protected:
  SilentHeartbeatProducerTest() : HeartbeatProducerTest(0) {}
};

TEST_F(SilentHeartbeatProducerTest, OnlyBootsUp) {
  producer.boot_up(at(0ms));
  EXPECT_EQ(pop_frames(queue).size(), 1U);
  EXPECT_EQ(producer.next_wake(), kNever);
}

TEST_F(SilentHeartbeatProducerTest, AWriteWhileInitialisingWaitsForTheBootUp) {
  EXPECT_EQ(testing::write<std::uint16_t>(dictionary, {0x1017, 0}, 30), AbortCode::none);
  EXPECT_EQ(frames_at(at(0ms)), 0U);
  producer.boot_up(at(10ms));
  EXPECT_EQ(producer.next_wake(), at(40ms));
}

}  // namespace
}  // namespace linegate::nmt
