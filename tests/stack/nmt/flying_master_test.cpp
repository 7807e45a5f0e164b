// SPDX-License-Identifier: Apache-2.0
// The table of states in stack/nmt/README.md, row by row.
#include "stack/nmt/flying_master.h"

#include <utility>
#include <vector>

#include <gtest/gtest.h>

namespace linegate::nmt {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;
using enum FlyingMasterState;

constexpr std::uint8_t kOwn = 10;
constexpr std::uint8_t kOwnPriority = 1;
constexpr Duration kDelay = milliseconds(500);
constexpr Duration kTimeout = milliseconds(100);
constexpr Duration kTurn = milliseconds(1500 + 100);  // priority 1, node 10
constexpr Duration kCycle = milliseconds(4100);

class FlyingMasterTest : public ::testing::Test, protected FlyingMasterHost {
 protected:
  FlyingMasterTest() {
    FlyingMasterTimes times;
    times.priority = kOwnPriority;
    times.detect_cycle = kCycle;
    machine_.set_times(times);
  }

  void send_master_message(const can::Frame& frame, Instant now) override {
    EXPECT_EQ(now, now_);
    sent_.push_back(frame);
  }
  bool reset_all(Instant now) override {
    EXPECT_EQ(now, now_);
    resets_ += keep_alive_ ? 0U : 1U;
    return !keep_alive_;
  }
  bool monitors_master() const override { return monitors_; }
  void flying_master_changed(FlyingMasterState before, Instant now) override {
    EXPECT_EQ(now, now_);
    changes_.push_back(before);
  }

  // Passes time; nothing is due before its end.
  void pass(Duration time) {
    now_ += time - milliseconds(1);
    machine_.advance(now_);
    EXPECT_TRUE(sent_.empty()) << "sent too early";
    now_ += milliseconds(1);
    machine_.advance(now_);
  }
  bool hear(std::uint16_t id, std::initializer_list<std::uint8_t> data = {}) {
    can::Frame frame = can::make_frame(id, data);
    frame.time = now_;
    return machine_.receive(frame);
  }
  void hear_master(std::uint8_t priority, std::uint8_t node) {
    EXPECT_TRUE(hear(kActiveMasterId, {priority, node}));
  }
  void expect_sent(std::vector<std::uint16_t> ids) {
    std::vector<std::uint16_t> sent;
    for (const can::Frame& frame : std::exchange(sent_, {})) {
      sent.push_back(static_cast<std::uint16_t>(frame.id));
      EXPECT_EQ(frame.length, frame.id == kActiveMasterId ? 2 : 0);
      if (frame.id == kActiveMasterId) {
        EXPECT_EQ(frame.data[0], std::byte{kOwnPriority});
        EXPECT_EQ(frame.data[1], std::byte{kOwn});
      }
    }
    EXPECT_EQ(sent, ids);
  }
  void expect(FlyingMasterState state, std::uint8_t master = 0) {
    EXPECT_EQ(machine_.state(), state);
    EXPECT_EQ(machine_.active_master(), master);
  }
  void power_on() { machine_.start(true, now_); }
  // From the start on: 073h was sent.
  void ask() {
    pass(kDelay);
    expect_sent({kDetectMasterId});
  }
  void become_negotiator() {
    power_on();
    EXPECT_TRUE(hear(kStartNegotiationId));
    expect(negotiate);
  }
  void become_master() {
    become_negotiator();
    pass(kTurn);
    expect_sent({kActiveMasterId});
    expect(master, kOwn);
  }
  void become_slave(std::uint8_t of = 20, std::uint8_t priority = kOwnPriority) {
    power_on();
    ask();
    hear_master(priority, of);
    expect(slave, of);
  }

  Instant now_{seconds(10)};
  bool keep_alive_ = false;
  bool monitors_ = false;
  unsigned resets_ = 0;
  std::vector<can::Frame> sent_;
  std::vector<FlyingMasterState> changes_;  // the states before
  FlyingMaster machine_{*this, kOwn};
};

TEST_F(FlyingMasterTest, OneThatDoesNotTakePartDoesNothing) {
  for (std::uint16_t id = kActiveMasterId; id <= kForceNegotiationId; ++id) {
    EXPECT_TRUE(hear(id, {0, 5}));
  }
  machine_.node_control({Command::reset_communication, 0}, now_);
  machine_.boot_up(now_);
  machine_.heartbeat_lost(5, now_);
  pass(seconds(60));
  expect_sent({});
  expect(none);
  EXPECT_EQ(machine_.next_wake(), kNever);
}

TEST_F(FlyingMasterTest, WithoutAMasterTheNodesAreResetOnceAndTheNegotiationBegins) {
  power_on();
  expect(detect);
  ask();
  pass(kTimeout);
  EXPECT_EQ(resets_, 1U);
  expect(reset);
  ask();
  expect(reset);
  pass(kTimeout);
  expect_sent({kStartNegotiationId});
  expect(negotiate);
  pass(kTurn);
  expect_sent({kActiveMasterId});
  expect(master, kOwn);
  EXPECT_EQ(resets_, 1U);
  EXPECT_EQ(changes_, (std::vector{none, detect, reset, negotiate}));
}

TEST_F(FlyingMasterTest, NodesThatAreKeptAliveAreNotReset) {
  keep_alive_ = true;
  power_on();
  ask();
  pass(kTimeout);
  expect_sent({kStartNegotiationId});
  expect(negotiate);
}

TEST_F(FlyingMasterTest, AfterAResetOfTheOwnNodeTheOthersAreNotReset) {
  machine_.start(false, now_);
  ask();
  pass(kTimeout);
  expect_sent({kStartNegotiationId});
  EXPECT_EQ(resets_, 0U);
}

TEST_F(FlyingMasterTest, AResetByAnotherNodeBeginsTheSearchAgainWithoutAnother) {
  for (const Command command : {Command::reset_communication, Command::reset_node}) {
    for (const std::uint8_t addressee : {std::uint8_t{0}, kOwn}) {
      power_on();
      pass(milliseconds(300));
      machine_.node_control({command, addressee}, now_);
      expect(detect);
      ask();
      pass(kTimeout);
      expect_sent({kStartNegotiationId});
      EXPECT_EQ(resets_, 0U);
    }
  }
}

TEST_F(FlyingMasterTest, OtherNmtCommandsDoNot) {
  become_slave();
  machine_.node_control({Command::start, 0}, now_);
  machine_.node_control({Command::reset_node, kOwn + 1}, now_);
  expect(slave, 20);
}

TEST_F(FlyingMasterTest, AnActiveMasterOfTheSameOrAHigherPriorityIsFollowed) {
  become_slave(20, kOwnPriority);
  become_slave(5, kOwnPriority);
  become_slave(127, 0);
  EXPECT_EQ(resets_, 0U);
}

TEST_F(FlyingMasterTest, AnActiveMasterOfALowerPriorityIsForcedToNegotiate) {
  power_on();
  ask();
  hear_master(kOwnPriority + 1, 5);
  expect_sent({kForceNegotiationId});
  expect(force);
  ask();
  pass(kTimeout);
  expect_sent({kStartNegotiationId});
  expect(negotiate);
  EXPECT_EQ(resets_, 0U) << "a master was active: the nodes were reset";
}

TEST_F(FlyingMasterTest, BeforeItAsksOnlyAMasterToFollowCounts) {
  power_on();
  hear_master(kOwnPriority + 1, 5);
  expect_sent({});
  expect(detect);
  hear_master(kOwnPriority, 5);
  expect(slave, 5);
}

TEST_F(FlyingMasterTest, TheTurnIsThatOfPriorityAndNodeId) {
  become_negotiator();
  pass(milliseconds(1000));
  EXPECT_TRUE(hear(kStartNegotiationId));
  pass(kTurn);
  expect_sent({kActiveMasterId});
  expect(master, kOwn);
}

TEST_F(FlyingMasterTest, WhoNegotiatesFollowsTheFirstOneOfThatPriority) {
  become_negotiator();
  hear_master(0, 100);
  expect(slave, 100);
  become_negotiator();
  hear_master(kOwnPriority, 100);
  expect(slave, 100);
  become_negotiator();
  hear_master(kOwnPriority + 1, 100);
  expect_sent({kForceNegotiationId});
  expect(force);
}

TEST_F(FlyingMasterTest, EachStateNegotiatesOnRequest) {
  become_master();
  EXPECT_TRUE(hear(kStartNegotiationId));
  expect(negotiate);
  become_slave();
  EXPECT_TRUE(hear(kStartNegotiationId));
  expect(negotiate);
  power_on();
  ask();
  EXPECT_TRUE(hear(kStartNegotiationId));
  expect(negotiate);
}

TEST_F(FlyingMasterTest, EachStateSearchesAgainWhenItIsForced) {
  const auto expect_search = [this] {
    EXPECT_TRUE(hear(kForceNegotiationId));
    expect(detect);
    ask();
    pass(kTimeout);
    expect_sent({kStartNegotiationId});
    EXPECT_EQ(resets_, 0U);
  };
  power_on();
  expect_search();
  become_master();
  expect_search();
  become_slave();
  expect_search();
  become_negotiator();
  expect_search();
}

TEST_F(FlyingMasterTest, TheMasterAnswersAndGreetsNodesThatBoot) {
  become_master();
  EXPECT_TRUE(hear(kDetectMasterId));
  expect_sent({kActiveMasterId});
  machine_.boot_up(now_);
  expect_sent({kActiveMasterId});
}

TEST_F(FlyingMasterTest, OthersDoNotAnswerThat) {
  power_on();
  EXPECT_TRUE(hear(kDetectMasterId));
  machine_.boot_up(now_);
  become_slave();
  EXPECT_TRUE(hear(kDetectMasterId));
  become_negotiator();
  EXPECT_TRUE(hear(kDetectMasterId));
  expect_sent({});
}

TEST_F(FlyingMasterTest, EachStateAnswersThatItCanBeMaster) {
  power_on();
  EXPECT_TRUE(hear(kCapableQuestionId));
  expect_sent({kCapableAnswerId});
  become_slave();
  EXPECT_TRUE(hear(kCapableQuestionId));
  expect_sent({kCapableAnswerId});
  become_master();
  EXPECT_TRUE(hear(kCapableQuestionId));
  expect_sent({kCapableAnswerId});
  EXPECT_TRUE(hear(kCapableAnswerId));
  expect(master, kOwn);
}

TEST_F(FlyingMasterTest, TheMasterLooksForASecondOneEachCycle) {
  become_master();
  pass(kCycle);
  expect_sent({kDetectMasterId});
  pass(kCycle);
  expect_sent({kDetectMasterId});
  machine_.set_detection(MasterDetection::force);
  pass(kCycle);
  expect_sent({kForceNegotiationId});
  expect(master, kOwn);
}

TEST_F(FlyingMasterTest, OfTwoMastersTheOneOfTheLowerRankSearchesAgain) {
  become_master();
  hear_master(kOwnPriority, kOwn + 1);
  expect_sent({kForceNegotiationId});
  expect(master, kOwn);
  hear_master(kOwnPriority, kOwn - 1);
  expect_sent({});
  expect(slave, kOwn - 1);
  become_master();
  hear_master(0, 100);
  expect(slave, 100);
  become_master();
  now_ += seconds(1);
  hear_master(2, 5);
  expect_sent({kForceNegotiationId});
  expect(master, kOwn);
}

TEST_F(FlyingMasterTest, ASecondMasterIsForcedAgainAfterAnotherQuestion) {
  become_master();
  hear_master(2, 5);
  expect_sent({kForceNegotiationId});
  hear_master(2, 5);
  expect_sent({});
  pass(kDelay + kTimeout);
  expect_sent({kDetectMasterId});
  hear_master(2, 5);
  expect_sent({kForceNegotiationId});
}

TEST_F(FlyingMasterTest, TheMasterAnswersNmtCommandsOfOthers) {
  become_master();
  now_ += kTimeout;
  machine_.node_control({Command::reset_communication, 0}, now_);
  expect_sent({kActiveMasterId});
  machine_.node_control({Command::start, 7}, now_);
  expect_sent({});
  now_ += kTimeout;
  machine_.node_control({Command::start, 7}, now_);
  expect_sent({kActiveMasterId});
  expect(master, kOwn);
}

TEST_F(FlyingMasterTest, TheLossOfTheMasterIsLikePowerOn) {
  become_slave(20);
  machine_.heartbeat_lost(21, now_);
  expect(slave, 20);
  machine_.heartbeat_lost(20, now_);
  expect(detect);
  ask();
  pass(kTimeout);
  EXPECT_EQ(resets_, 1U);
  expect(reset);
}

TEST_F(FlyingMasterTest, ASlaveAsksIfItsMasterIsSilent) {
  become_slave(20);
  now_ += kCycle - milliseconds(10);
  hear_master(kOwnPriority, 20);
  pass(kCycle);
  expect_sent({kDetectMasterId});
  expect(slave, 20);
  hear_master(kOwnPriority, 20);
  pass(kCycle);
  expect_sent({kDetectMasterId});
  pass(kTimeout);
  expect(detect);
  ask();
  pass(kTimeout);
  expect_sent({kStartNegotiationId});
  EXPECT_EQ(resets_, 0U) << "it is not known to be lost";
}

// Its process may have to wait for the processor, or for memory.
TEST_F(FlyingMasterTest, ALateMasterThatIsMonitoredIsNotReplaced) {
  monitors_ = true;
  become_slave(20);
  machine_.heartbeat(20, now_);
  pass(kCycle);
  expect_sent({kDetectMasterId});
  for (int i = 0; i < 80; ++i) {
    pass(kTimeout);
    expect_sent({});
    expect(slave, 20);
  }
  hear_master(kOwnPriority, 20);
  pass(kCycle);
  expect_sent({kDetectMasterId});
  machine_.heartbeat_lost(20, now_);
  ask();
  pass(kTimeout);
  EXPECT_EQ(resets_, 1U);
}

// Two lost frames are no loss of the master; but a node that is none any more does not answer.
TEST_F(FlyingMasterTest, AMasterWithAHeartbeatIsAskedThreeTimes) {
  monitors_ = true;
  become_slave(20);
  machine_.heartbeat(20, now_);
  pass(kCycle);
  for (int i = 0; i < 3; ++i) {
    expect_sent({kDetectMasterId});
    expect(slave, 20);
    now_ += milliseconds(1);
    machine_.heartbeat(20, now_);
    now_ -= milliseconds(1);
    pass(kTimeout);
  }
  expect(detect);
  ask();
  pass(kTimeout);
  expect_sent({kStartNegotiationId});
  EXPECT_EQ(resets_, 0U);
}

// That of the time before it was followed does not count: it may never send one again.
TEST_F(FlyingMasterTest, AMasterWithoutAHeartbeatIsAskedOnce) {
  monitors_ = true;
  become_slave(20);
  machine_.heartbeat(21, now_);
  pass(kCycle);
  expect_sent({kDetectMasterId});
  pass(kTimeout);
  expect(detect);
}

TEST_F(FlyingMasterTest, ASlaveFollowsAnotherMasterOfItsPriority) {
  become_slave(20);
  hear_master(0, 30);
  expect(slave, 30);
  hear_master(kOwnPriority, 40);
  expect(slave, 40);
  hear_master(kOwnPriority + 1, 50);
  expect(slave, 40);
  pass(kCycle);
  expect_sent({kDetectMasterId});
  hear_master(kOwnPriority + 1, 50);
  expect_sent({kForceNegotiationId});
  expect(force);
}

TEST_F(FlyingMasterTest, ItStops) {
  become_master();
  machine_.stop(now_);
  expect(none);
  pass(seconds(60));
  expect_sent({});
}

TEST_F(FlyingMasterTest, MalformedMessagesAreRejected) {
  become_master();
  EXPECT_FALSE(hear(kActiveMasterId, {3, 5})) << "no priority";
  EXPECT_FALSE(hear(kActiveMasterId, {0, 0}));
  EXPECT_FALSE(hear(kActiveMasterId, {0, 128}));
  EXPECT_FALSE(hear(kActiveMasterId, {0}));
  EXPECT_FALSE(hear(kActiveMasterId, {0, 5, 0}));
  EXPECT_FALSE(hear(kActiveMasterId, {0, kOwn})) << "another device has the own node-ID";
  can::Frame remote = can::make_frame(kActiveMasterId, {0, 5});
  remote.flags = can::Frame::kRemote;
  EXPECT_FALSE(machine_.receive(remote));
  for (std::uint16_t id = kStartNegotiationId; id <= kForceNegotiationId; ++id) {
    EXPECT_FALSE(hear(id, {0, 0, 0, 0, 0, 0, 0, 0}));
  }
  expect(master, kOwn);
  expect_sent({});
}

}  // namespace
}  // namespace linegate::nmt
