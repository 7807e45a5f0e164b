// SPDX-License-Identifier: Apache-2.0
#include "stack/nmt/heartbeat_consumer.h"

#include <string>

#include <gtest/gtest.h>

#include "tests/stack/node/objects.h"

namespace linegate::nmt {
namespace {

using namespace std::chrono_literals;
using testing::at;
using testing::frame_at;
using testing::pop_events;

struct Diary : HeartbeatListener {
  void boot_up(std::uint8_t node, Instant now) override { add("boot", node, now); }
  void heartbeat(std::uint8_t node, State state, Instant now) override {
    add(std::string(name(state)), node, now);
  }
  void heartbeat_lost(std::uint8_t node, Instant deadline) override { add("lost", node, deadline); }
  void heartbeat_recovered(std::uint8_t node, Instant now) override { add("back", node, now); }

  void add(std::string what, std::uint8_t node, Instant now) {
    const auto ms = std::chrono::duration_cast<std::chrono::milliseconds>(now - at(0ms)).count();
    lines.push_back(what + ' ' + std::to_string(node) + " @" + std::to_string(ms));
  }
  std::vector<std::string> take() { return std::exchange(lines, {}); }

  std::vector<std::string> lines;
};

using Lines = std::vector<std::string>;

class HeartbeatConsumerTest : public ::testing::Test {
 protected:
  HeartbeatConsumerTest() { consumer.set_listener(&diary); }

  bool hear(std::uint8_t node, std::uint8_t state, Duration when) {
    return consumer.receive(node, frame_at(at(when), 0x700U + node, {state})) ==
           ErrorControlReception::accepted;
  }

  can::Dispatch dispatch;
  EventLog events;
  HeartbeatConsumer consumer{dispatch, events};
  Diary diary;
};

TEST_F(HeartbeatConsumerTest, MonitoringStartsWithTheFirstHeartbeat) {
  consumer.monitor(5, 100ms);
  consumer.advance(at(10s));
  EXPECT_EQ(consumer.next_wake(), kNever);
  EXPECT_TRUE(hear(5, 0x7F, 11s));
  EXPECT_EQ(consumer.next_wake(), at(11s + 100ms));
  EXPECT_EQ(diary.take(), (Lines{"pre-operational 5 @11000"}));
}

TEST_F(HeartbeatConsumerTest, LossIsToldAtItsDeadline) {
  consumer.monitor(5, 100ms);
  hear(5, 0x05, 0ms);
  pop_events(events);
  consumer.advance(at(99ms));
  EXPECT_TRUE(events.empty());
  consumer.advance(at(250ms));
  const auto told = pop_events(events);
  ASSERT_EQ(told.size(), 1U);
  EXPECT_EQ(told[0].node, 5);
  EXPECT_EQ(told[0].time, at(100ms));
  EXPECT_EQ(std::get<event::HeartbeatLost>(told[0].data).time, 100ms);
  EXPECT_TRUE(consumer.lost(5));
  consumer.advance(at(10s));
  EXPECT_TRUE(events.empty());
}

TEST_F(HeartbeatConsumerTest, ALateThreadReportsNoLossThatDidNotHappen) {
  consumer.monitor(5, 100ms);
  for (int i = 0; i <= 10; ++i) {
    hear(5, 0x05, i * 90ms);
  }
  consumer.advance(at(950ms));
  EXPECT_FALSE(consumer.lost(5));
}

TEST_F(HeartbeatConsumerTest, AHeartbeatAfterItsDeadlineIsALossAndARecovery) {
  consumer.monitor(5, 100ms);
  hear(5, 0x05, 0ms);
  pop_events(events);
  diary.take();
  hear(5, 0x05, 130ms);
  const auto told = pop_events(events);
  ASSERT_EQ(told.size(), 2U);
  EXPECT_EQ(told[0].kind(), EventKind::heartbeat_lost);
  EXPECT_EQ(told[0].time, at(100ms));
  EXPECT_EQ(told[1].time, at(130ms));
  EXPECT_EQ(told[1].data, EventData(event::HeartbeatRecovered{State::operational}));
  EXPECT_EQ(diary.take(), (Lines{"lost 5 @100", "back 5 @130", "operational 5 @130"}));
  EXPECT_EQ(consumer.next_wake(), at(230ms));
}

TEST_F(HeartbeatConsumerTest, AHeartbeatAtTheDeadlineIsInTime) {
  consumer.monitor(5, 100ms);
  hear(5, 0x05, 0ms);
  hear(5, 0x05, 100ms);
  EXPECT_FALSE(consumer.lost(5));
  EXPECT_EQ(consumer.next_wake(), at(200ms));
}

TEST_F(HeartbeatConsumerTest, LossesAreToldInTheOrderInWhichTheyHappened) {
  consumer.monitor(5, 300ms);
  consumer.monitor(9, 100ms);
  consumer.monitor(127, 200ms);
  hear(5, 0x05, 0ms);
  hear(9, 0x05, 0ms);
  hear(127, 0x05, 0ms);
  diary.take();
  consumer.advance(at(1s));
  EXPECT_EQ(diary.take(), (Lines{"lost 9 @100", "lost 127 @200", "lost 5 @300"}));
}

TEST_F(HeartbeatConsumerTest, AStateChangeIsAnEventOnce) {
  consumer.listen(5);
  hear(5, 0x7F, 0ms);
  hear(5, 0x7F, 10ms);
  hear(5, 0x05, 20ms);
  const auto told = pop_events(events);
  ASSERT_EQ(told.size(), 2U);
  EXPECT_EQ(told[0].data,
            EventData(event::NodeState{.state = State::pre_operational, .before = State::unknown}));
  EXPECT_EQ(told[1].data, EventData(event::NodeState{.state = State::operational,
                                                     .before = State::pre_operational}));
  EXPECT_EQ(consumer.state(5), State::operational);
}

TEST_F(HeartbeatConsumerTest, BootUpStartsTheMonitoringOver) {
  consumer.monitor(5, 100ms);
  hear(5, 0x05, 0ms);
  hear(5, 0x00, 50ms);
  EXPECT_EQ(consumer.state(5), State::pre_operational);
  EXPECT_EQ(consumer.next_wake(), kNever);
  hear(5, 0x7F, 500ms);
  EXPECT_EQ(consumer.next_wake(), at(600ms));
  EXPECT_EQ(diary.take(), (Lines{"operational 5 @0", "boot 5 @50", "pre-operational 5 @500"}));
}

TEST_F(HeartbeatConsumerTest, BootUpAfterALossIsNotYetTheRecovery) {
  consumer.monitor(5, 100ms);
  hear(5, 0x05, 0ms);
  hear(5, 0x00, 150ms);
  EXPECT_TRUE(consumer.lost(5));
  hear(5, 0x7F, 160ms);
  EXPECT_FALSE(consumer.lost(5));
  EXPECT_EQ(diary.take(), (Lines{"operational 5 @0", "lost 5 @100", "boot 5 @150", "back 5 @160",
                                 "pre-operational 5 @160"}));
}

TEST_F(HeartbeatConsumerTest, MalformedFramesChangeNothing) {
  consumer.monitor(5, 100ms);
  hear(5, 0x05, 0ms);
  pop_events(events);
  diary.take();
  EXPECT_EQ(consumer.receive(5, frame_at(at(50ms), 0x705, {})), ErrorControlReception::malformed);
  EXPECT_EQ(consumer.receive(5, frame_at(at(50ms), 0x705, {0x05, 0x00})),
            ErrorControlReception::malformed);
  for (const int reserved : {0x01, 0x06, 0x7E, 0x85, 0xFF}) {
    EXPECT_FALSE(hear(5, static_cast<std::uint8_t>(reserved), 50ms)) << reserved;
  }
  EXPECT_TRUE(events.empty());
  EXPECT_TRUE(diary.take().empty());
  EXPECT_EQ(consumer.next_wake(), at(100ms));
}

TEST_F(HeartbeatConsumerTest, StopEndsTheMonitoringOnly) {
  consumer.monitor(5, 100ms);
  hear(5, 0x05, 0ms);
  consumer.stop(5);
  EXPECT_FALSE(consumer.monitored(5));
  EXPECT_EQ(consumer.next_wake(), kNever);
  consumer.advance(at(10s));
  EXPECT_FALSE(consumer.lost(5));
  EXPECT_NE(dispatch.find(frame_at(at(0ms), 0x705, {0x05})), nullptr);
}

TEST_F(HeartbeatConsumerTest, MarksKeepTwoConsumersApart) {
  HeartbeatConsumer other(dispatch, events, 0x100);
  consumer.listen(5);
  other.listen(5);
  const can::Target* target = dispatch.find(frame_at(at(0ms), 0x705, {0x05}));
  ASSERT_NE(target, nullptr);
  EXPECT_EQ(target->service, can::Service::error_control);
  EXPECT_EQ(target->index, 5);
  target = dispatch.next(*target);
  ASSERT_NE(target, nullptr);
  EXPECT_EQ(target->index, 0x105);
  other.ignore(5);
  target = dispatch.find(frame_at(at(0ms), 0x705, {0x05}));
  ASSERT_NE(target, nullptr);
  EXPECT_EQ(dispatch.next(*target), nullptr);
}

TEST_F(HeartbeatConsumerTest, ListensToAllButTheOwnNode) {
  consumer.listen_all(7);
  EXPECT_EQ(dispatch.find(frame_at(at(0ms), 0x707, {0x05})), nullptr);
  EXPECT_EQ(dispatch.find(frame_at(at(0ms), 0x700, {0x05})), nullptr);
  EXPECT_NE(dispatch.find(frame_at(at(0ms), 0x701, {0x05})), nullptr);
  EXPECT_NE(dispatch.find(frame_at(at(0ms), 0x77F, {0x05})), nullptr);
}

TEST_F(HeartbeatConsumerTest, AllNodesAtOnce) {  // 1016h
  for (std::uint8_t node = 1; node <= 127; ++node) {
    consumer.monitor(node, std::chrono::milliseconds(1000 - node));
    hear(node, 0x05, 0ms);
  }
  EXPECT_EQ(consumer.next_wake(), at(873ms));
  diary.take();
  consumer.advance(at(2s));
  EXPECT_EQ(diary.take().size(), 127U);
}

}  // namespace
}  // namespace linegate::nmt
