// SPDX-License-Identifier: Apache-2.0
// Node guarding and life guarding, both roles.
#include <string>

#include <gtest/gtest.h>

#include "stack/nmt/guarding_slave.h"
#include "stack/nmt/heartbeat_consumer.h"
#include "stack/od/objects.h"

#include "tests/stack/node/objects.h"

namespace linegate::nmt {
namespace {

using namespace std::chrono_literals;
using testing::at;
using testing::data_of;
using testing::frame_at;
using testing::pop_events;
using testing::pop_frames;

constexpr std::uint8_t kNode = 5;

struct Telling : LifeGuardingListener {
  void life_guarding_lost(Instant deadline) override { losses.push_back(deadline); }
  void life_guarding_recovered(Instant now) override { recoveries.push_back(now); }

  std::vector<Instant> losses;
  std::vector<Instant> recoveries;
};

class GuardingSlaveTest : public ::testing::Test {
 protected:
  GuardingSlaveTest() {
    for (const std::uint16_t index : {od::objects::kGuardTime, od::objects::kLifeTimeFactor}) {
      EXPECT_TRUE(dictionary.set_hook(index, &slave).ok());
    }
    slave.configure();
    slave.set_state(State::pre_operational);
  }

  // The bytes of the responses to one request.
  std::vector<int> ask(Duration when) {
    slave.request(at(when));
    std::vector<int> out;
    for (const can::Frame& frame : pop_frames(transmit)) {
      EXPECT_EQ(frame.id, 0x705U);
      EXPECT_EQ(frame.length, 1U);
      EXPECT_EQ(frame.flags, 0U);
      out.push_back(data_of(frame)[0]);
    }
    return out;
  }
  void guard(std::uint16_t guard_time, std::uint8_t factor) {
    EXPECT_EQ(testing::write(dictionary, {od::objects::kGuardTime, 0}, guard_time),
              AbortCode::none);
    EXPECT_EQ(testing::write(dictionary, {od::objects::kLifeTimeFactor, 0}, factor),
              AbortCode::none);
  }

  od::Dictionary dictionary =
      testing::dictionary_of({testing::object(0x100C, od::DataType::unsigned16, 0),
                              testing::object(0x100D, od::DataType::unsigned8, 0),
                              testing::object(0x1017, od::DataType::unsigned16, 0)});
  can::TransmitQueue transmit;
  EventLog events;
  Telling told;
  GuardingSlave slave{dictionary, transmit, events, told, kNode};
};

using Bytes = std::vector<int>;

TEST_F(GuardingSlaveTest, AnswersWithTheStateAndAToggleBitThatBeginsWithZero) {
  EXPECT_EQ(ask(0ms), Bytes{0x7F});
  EXPECT_EQ(ask(1ms), Bytes{0xFF});
  slave.set_state(State::operational);
  EXPECT_EQ(ask(2ms), Bytes{0x05});
  EXPECT_EQ(ask(3ms), Bytes{0x85});
  slave.set_state(State::stopped);
  EXPECT_EQ(ask(4ms), Bytes{0x04});
  slave.configure();
  EXPECT_EQ(ask(5ms), Bytes{0x04}) << "the toggle bit is 0 after a reset";
}

TEST_F(GuardingSlaveTest, SaysNothingWhileInitialisingOrWithAHeartbeat) {
  slave.set_state(State::initialising);
  EXPECT_EQ(ask(0ms), Bytes{});
  slave.set_state(State::operational);
  guard(10, 2);
  ASSERT_TRUE(dictionary.set(od::Address{0x1017, 0}, 100));
  EXPECT_EQ(ask(1ms), Bytes{});
  EXPECT_EQ(slave.next_wake(), kNever) << "the heartbeat disables guarding";
}

TEST_F(GuardingSlaveTest, LifeGuardingStartsWithTheFirstRequest) {
  guard(100, 3);
  slave.advance(at(10s));
  EXPECT_EQ(slave.next_wake(), kNever);
  ask(10s);
  EXPECT_EQ(slave.next_wake(), at(10s + 300ms));
  ask(10s + 299ms);
  slave.advance(at(10s + 598ms));
  EXPECT_TRUE(told.losses.empty());
  slave.advance(at(10s + 599ms));
  EXPECT_EQ(told.losses, (std::vector<Instant>{at(10s + 599ms)}));
  const auto lost = pop_events(events);
  ASSERT_EQ(lost.size(), 1U);
  EXPECT_EQ(lost[0].node, kNode);
  EXPECT_EQ(lost[0].data, EventData(event::HeartbeatLost{.by = event::ErrorControl::life_guarding,
                                                         .time = 300ms}));
}

TEST_F(GuardingSlaveTest, NeitherTimeNorFactorMeansNoLifeGuarding) {
  guard(100, 0);
  EXPECT_EQ(ask(0ms), Bytes{0x7F});
  EXPECT_EQ(slave.next_wake(), kNever);
  guard(0, 3);
  ask(1ms);
  EXPECT_EQ(slave.next_wake(), kNever);
}

TEST_F(GuardingSlaveTest, WhileSuspendedNoRequestIsMissed) {
  guard(100, 1);
  ask(0ms);
  slave.set_suspended(true);
  EXPECT_EQ(slave.next_wake(), kNever);
  EXPECT_FALSE(ask(50ms).empty()) << "requests are still answered";
  slave.advance(at(10s));
  EXPECT_TRUE(told.losses.empty());
  slave.set_suspended(false);
  ask(10s);
  EXPECT_EQ(slave.next_wake(), at(10s + 100ms));
}

TEST_F(GuardingSlaveTest, ARequestEndsTheLoss) {
  guard(100, 1);
  ask(0ms);
  slave.advance(at(100ms));
  ask(150ms);
  EXPECT_EQ(told.recoveries, (std::vector<Instant>{at(150ms)}));
  EXPECT_EQ(slave.next_wake(), at(250ms));
  ask(160ms);
  EXPECT_EQ(told.recoveries.size(), 1U);
}

TEST_F(GuardingSlaveTest, ALateRequestTellsTheLossFirst) {
  guard(100, 1);
  ask(0ms);
  ask(101ms);
  EXPECT_EQ(told.losses, (std::vector<Instant>{at(100ms)}));
  EXPECT_EQ(told.recoveries, (std::vector<Instant>{at(101ms)}));
}

TEST_F(GuardingSlaveTest, AWriteWaitsForTheNextRequest) {
  guard(100, 1);
  ask(0ms);
  guard(50, 1);
  EXPECT_EQ(slave.next_wake(), kNever);
  ask(10ms);
  EXPECT_EQ(slave.next_wake(), at(60ms));
  ASSERT_TRUE(dictionary.set(od::Address{0x1017, 0}, 100));
  slave.advance(at(60ms));
  EXPECT_TRUE(told.losses.empty()) << "error control is a heartbeat now";
}

struct Heard : HeartbeatListener {
  void heartbeat(std::uint8_t node, State state, Instant /*now*/) override {
    words.push_back(std::to_string(node) + ' ' + std::string(name(state)));
  }
  void boot_up(std::uint8_t node, Instant /*now*/) override {
    words.push_back(std::to_string(node) + " boot-up");
  }
  void heartbeat_lost(std::uint8_t node, Instant /*deadline*/) override {
    words.push_back(std::to_string(node) + " lost");
  }
  void heartbeat_recovered(std::uint8_t node, Instant /*now*/) override {
    words.push_back(std::to_string(node) + " back");
  }

  std::vector<std::string> words;
};

using Words = std::vector<std::string>;

class GuardingMasterTest : public ::testing::Test {
 protected:
  GuardingMasterTest() { consumer.set_listener(&heard); }

  bool answer(std::uint8_t content, Duration when, std::uint8_t node = kNode) {
    return receive(content, when, node) == ErrorControlReception::accepted;
  }
  ErrorControlReception receive(std::uint8_t content, Duration when, std::uint8_t node = kNode) {
    return consumer.receive(node, frame_at(at(when), 0x700U + node, {content}));
  }
  // The nodes that were guarded since the last call.
  std::vector<int> asked() {
    std::vector<int> out;
    for (const can::Frame& frame : pop_frames(transmit)) {
      EXPECT_EQ(frame.flags, can::Frame::kRemote);
      EXPECT_EQ(frame.length, 1U);
      out.push_back(static_cast<int>(frame.id) - 0x700);
    }
    return out;
  }

  can::Dispatch dispatch;
  EventLog events;
  can::TransmitQueue transmit;
  HeartbeatConsumer consumer{dispatch, events, 0, &transmit};
  Heard heard;
};

TEST_F(GuardingMasterTest, AsksAtOnceAndThenEveryGuardTime) {
  consumer.guard(kNode, 100ms, 3, at(0ms));
  EXPECT_TRUE(consumer.guarded(kNode));
  EXPECT_EQ(asked(), (std::vector<int>{5}));
  EXPECT_EQ(consumer.next_wake(), at(100ms));
  consumer.advance(at(99ms));
  EXPECT_EQ(asked(), (std::vector<int>{}));
  consumer.advance(at(103ms));
  EXPECT_EQ(asked(), (std::vector<int>{5}));
  EXPECT_EQ(consumer.next_wake(), at(200ms)) << "no drift";
}

TEST_F(GuardingMasterTest, TheToggleBitAlternates) {
  consumer.guard(kNode, 100ms, 3, at(0ms));
  EXPECT_TRUE(answer(0xFF, 1ms)) << "any first toggle bit";
  EXPECT_TRUE(answer(0x7F, 101ms));
  EXPECT_TRUE(answer(0x85, 201ms));
  EXPECT_EQ(receive(0x85, 301ms), ErrorControlReception::not_alternated);
  EXPECT_TRUE(answer(0x05, 401ms));
  EXPECT_EQ(heard.words,
            (Words{"5 pre-operational", "5 pre-operational", "5 operational", "5 operational"}));
  EXPECT_EQ(consumer.state(kNode), State::operational);
}

TEST_F(GuardingMasterTest, AfterABootUpTheFirstAnswerHasZero) {
  consumer.guard(kNode, 100ms, 3, at(0ms));
  EXPECT_TRUE(answer(0x7F, 1ms));
  EXPECT_TRUE(answer(0x00, 50ms));
  EXPECT_FALSE(answer(0xFF, 101ms));
  EXPECT_TRUE(answer(0x7F, 201ms));
  EXPECT_EQ(heard.words, (Words{"5 pre-operational", "5 boot-up", "5 pre-operational"}));
}

TEST_F(GuardingMasterTest, ANodeThatIsNotGuardedCanBeAskedOnce) {
  consumer.ask(kNode);
  EXPECT_EQ(asked(), (std::vector<int>{5}));
  EXPECT_FALSE(consumer.guarded(kNode));
  EXPECT_EQ(consumer.next_wake(), kNever) << "without a response no loss";
  EXPECT_TRUE(answer(0x85, 1ms)) << "any toggle bit";
  EXPECT_FALSE(answer(0x85, 2ms)) << "no request";
  EXPECT_EQ(heard.words, (Words{"5 operational"}));
}

TEST_F(GuardingMasterTest, WhatIsNoAnswerIsRefused) {
  consumer.guard(kNode, 100ms, 3, at(0ms));
  constexpr auto kMalformed = ErrorControlReception::malformed;
  EXPECT_EQ(consumer.receive(kNode, frame_at(at(1ms), 0x705, {})), kMalformed);
  EXPECT_EQ(consumer.receive(kNode, frame_at(at(1ms), 0x705, {0x05, 0x05})), kMalformed);
  EXPECT_EQ(receive(0x33, 1ms), kMalformed);
  EXPECT_EQ(receive(0x80, 1ms), kMalformed);
  EXPECT_TRUE(heard.words.empty());
  EXPECT_TRUE(answer(0x05, 2ms));
  EXPECT_EQ(receive(0xB3, 3ms), kMalformed);
  EXPECT_TRUE(answer(0x85, 4ms)) << "a malformed frame does not change the expected toggle bit";
}

TEST_F(GuardingMasterTest, WithoutAnAnswerForTheLifeTimeItIsLost) {
  consumer.guard(kNode, 100ms, 3, at(0ms));
  consumer.advance(at(299ms));
  EXPECT_FALSE(consumer.lost(kNode));
  consumer.advance(at(300ms));
  EXPECT_TRUE(consumer.lost(kNode));
  const auto told = pop_events(events);
  ASSERT_EQ(told.size(), 1U);
  EXPECT_EQ(told[0].time, at(300ms));
  EXPECT_EQ(told[0].node, kNode);
  EXPECT_EQ(told[0].data, EventData(event::HeartbeatLost{.by = event::ErrorControl::node_guarding,
                                                         .time = 300ms}));
  EXPECT_EQ(consumer.next_wake(), at(400ms)) << "guarding continues";
  EXPECT_TRUE(answer(0x05, 350ms));
  EXPECT_FALSE(consumer.lost(kNode));
  EXPECT_EQ(heard.words, (Words{"5 lost", "5 back", "5 operational"}));
}

TEST_F(GuardingMasterTest, AnAnswerWithTheWrongToggleBitCountsForNothing) {
  consumer.guard(kNode, 100ms, 2, at(0ms));
  EXPECT_TRUE(answer(0x05, 10ms));
  EXPECT_EQ(receive(0x05, 110ms), ErrorControlReception::not_alternated);
  EXPECT_EQ(receive(0x7F, 209ms), ErrorControlReception::not_alternated) << "another state";
  EXPECT_EQ(consumer.state(kNode), State::operational);
  consumer.advance(at(210ms));
  EXPECT_TRUE(consumer.lost(kNode));
}

TEST_F(GuardingMasterTest, HeartbeatAndGuardingExcludeEachOther) {
  consumer.guard(kNode, 100ms, 2, at(0ms));
  consumer.monitor(kNode, 500ms);
  EXPECT_FALSE(consumer.guarded(kNode));
  asked();
  consumer.advance(at(1s));
  EXPECT_EQ(asked(), (std::vector<int>{}));
  EXPECT_FALSE(answer(0x85, 1s)) << "no toggle bit in a heartbeat";
  consumer.guard(kNode, 100ms, 2, at(2s));
  EXPECT_EQ(consumer.time(kNode), Duration(200ms));
  consumer.guard(kNode, 100ms, 0, at(2s));
  EXPECT_FALSE(consumer.guarded(kNode));
  EXPECT_FALSE(consumer.monitored(kNode));
  asked();
  consumer.advance(at(9s));
  EXPECT_EQ(consumer.next_wake(), kNever);
}

TEST_F(GuardingMasterTest, AllNodesAtOnceAndNoPileOfRequests) {
  for (std::uint8_t node = 1; node <= 127; ++node) {
    consumer.guard(node, 100ms, 200, at(0ms));
  }
  for (int i = 1; i < 20; ++i) {
    consumer.advance(at(i * 100ms));
  }
  EXPECT_EQ(asked().size(), 127U) << "one request for each node";
  consumer.advance(at(2s));
  EXPECT_EQ(asked().size(), 127U);
  for (std::uint8_t node = 1; node <= 127; ++node) {
    consumer.stop(node);
  }
  consumer.advance(at(3s));
  EXPECT_EQ(asked(), (std::vector<int>{}));
}

}  // namespace
}  // namespace linegate::nmt
