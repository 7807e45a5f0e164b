// SPDX-License-Identifier: Apache-2.0
#include "stack/line/output_receivers.h"

#include <vector>

#include <gtest/gtest.h>

#include "tests/stack/line/service_fixture.h"

namespace linegate::line {
namespace {

using Receiver = pdo::Engine::Receiver;

struct OutputReceiversTest : testing::Test, manager::Host {
  void node_data_invalid(std::uint8_t /*node*/) override {}
  void mandatory_nodes_booted(Instant /*now*/) override {}
  void send_nmt(nmt::Command command, std::uint8_t node, Instant /*now*/) override {
    EXPECT_EQ(command, nmt::Command::start);
    started.push_back(node);
  }
  bool acknowledges_starts() const override { return true; }
  void command_own(nmt::Command /*command*/, Instant /*now*/) override {}
  nmt::State own_state() const override { return nmt::State::operational; }

  // Receives a heartbeat of the node.
  void heartbeat(nmt::State state, Duration after) {
    receivers.confirm(kAxis, state, now + after);
    managed.manager.heartbeat(kAxis, state, now + after);
  }
  // The line is to send the command.
  void order(nmt::Command command) {
    receivers.commanded(command, kAxis);
    managed.manager.commanded(command, kAxis, now);
  }
  // Another master has sent it.
  void hear(nmt::Command command) {
    receivers.heard(command, kAxis);
    managed.manager.heard(command, kAxis);
  }
  void hand_out(nmt::Command command, std::uint64_t number) {
    receivers.handed_out(nmt::encode({command, kAxis}), number);
  }

  ManagerParts managed{false};
  NodeParts parts{config_with_axis()};
  Instant now = parts.now;
  nmt::Master master{managed.transmit};
  RecordingHost host;
  std::vector<std::uint8_t> started;
  NoFlyingMaster flying{host, parts, managed.manager};
  OutputReceivers receivers{host,
                            parts.config,
                            {.manager = managed.manager,
                             .nmt = *this,
                             .master = master,
                             .pdos = parts.node->pdos(),
                             .flying = flying.service}};
};

TEST_F(OutputReceiversTest, ANodeReceivesWhileItIsKnownToBeOperational) {
  EXPECT_EQ(receivers.state(kAxis), Receiver::waiting);
  heartbeat(nmt::State::pre_operational, {});
  EXPECT_EQ(receivers.state(kAxis), Receiver::waiting);
  heartbeat(nmt::State::operational, {});
  EXPECT_EQ(receivers.state(kAxis), Receiver::started);
  receivers.follow();
  EXPECT_EQ(parts.node->pdos().receiver(kAxis), Receiver::started);
  host.set_usable(false);
  receivers.mark_changed();
  receivers.follow();
  EXPECT_EQ(parts.node->pdos().receiver(kAxis), Receiver::waiting);
}

TEST_F(OutputReceiversTest, OfANodeOfAnotherMasterNothingMayBeKnown) {
  host.set_manages(false);
  EXPECT_EQ(receivers.state(kAxis), Receiver::unheard);
  EXPECT_TRUE(receivers.takes_single_writes(kAxis));
  heartbeat(nmt::State::stopped, {});
  EXPECT_EQ(receivers.state(kAxis), Receiver::waiting);
  EXPECT_FALSE(receivers.takes_single_writes(kAxis));
  EXPECT_TRUE(receivers.takes_single_writes(parts.config.node_id));
}

TEST_F(OutputReceiversTest, AfterACommandThatEndsOperationalTwoHeartbeatsShowTheState) {
  heartbeat(nmt::State::operational, {});
  receivers.commanded(nmt::Command::stop, kAxis);
  EXPECT_EQ(receivers.state(kAxis), Receiver::waiting);
  heartbeat(nmt::State::operational, milliseconds(100));
  heartbeat(nmt::State::operational, milliseconds(101));
  EXPECT_EQ(receivers.state(kAxis), Receiver::waiting) << "two heartbeats at once count as one";
  heartbeat(nmt::State::operational, milliseconds(200));
  EXPECT_EQ(receivers.state(kAxis), Receiver::started);
}

TEST_F(OutputReceiversTest, ACommandThatEndsOperationalCountsUntilItIsAcknowledgedOrLost) {
  heartbeat(nmt::State::operational, {});
  hand_out(nmt::Command::stop, 7);
  EXPECT_EQ(receivers.state(kAxis), Receiver::waiting);
  receivers.acknowledged(6);
  EXPECT_EQ(receivers.state(kAxis), Receiver::waiting);
  receivers.lost(7, 7);
  EXPECT_EQ(receivers.state(kAxis), Receiver::started);
  hand_out(nmt::Command::stop, 8);
  receivers.acknowledged(8);
  EXPECT_EQ(receivers.state(kAxis), Receiver::waiting) << "the heartbeats precede the stop";
}

// Its own commands wait for the bus while another master starts the node, which sends no heartbeat.
TEST_F(OutputReceiversTest, ACommandBehindTheStartOfAnotherMasterEndsOperational) {
  const auto state = [this] { return managed.manager.node(kAxis).state; };
  managed.manager.boot_up(kAxis, now);
  receivers.commanded(nmt::Command::stop, kAxis);
  hand_out(nmt::Command::stop, 7);
  receivers.commanded(nmt::Command::start, kAxis);
  hand_out(nmt::Command::start, 8);
  hear(nmt::Command::start);
  EXPECT_EQ(state(), nmt::State::operational);
  receivers.acknowledged(7);
  EXPECT_EQ(state(), nmt::State::stopped);
  EXPECT_EQ(receivers.state(kAxis), Receiver::waiting);
  receivers.acknowledged(8);
  EXPECT_EQ(state(), nmt::State::operational);
  EXPECT_EQ(receivers.state(kAxis), Receiver::started);
}

TEST_F(OutputReceiversTest, AStartThatWaitsForRoomInTheControllerFollowsTheCommandBeforeIt) {
  managed.awaits_acknowledgements = true;
  managed.manager.boot_up(kAxis, now);
  order(nmt::Command::stop);
  hand_out(nmt::Command::stop, 7);
  order(nmt::Command::start);
  receivers.acknowledged(7);
  hand_out(nmt::Command::start, 8);
  receivers.acknowledged(8);
  EXPECT_EQ(managed.manager.node(kAxis).state, nmt::State::operational);
  EXPECT_EQ(receivers.state(kAxis), Receiver::started);
}

// Until its boot-up message a node that was reset does not follow the start behind the reset.
TEST_F(OutputReceiversTest, AStartBehindAResetDoesNotMakeTheNodeOperational) {
  const auto state = [this] { return managed.manager.node(kAxis).state; };
  managed.manager.boot_up(kAxis, now);
  hand_out(nmt::Command::reset_communication, 7);
  hand_out(nmt::Command::start, 8);
  managed.manager.heard(nmt::Command::start, kAxis);
  receivers.acknowledged(7);
  EXPECT_EQ(state(), nmt::State::unknown);
  receivers.acknowledged(8);
  EXPECT_EQ(state(), nmt::State::unknown);
  managed.manager.boot_up(kAxis, now);
  EXPECT_EQ(state(), nmt::State::pre_operational);
}

// A stop of another master reaches the node before a start of the line that is still to be sent.
TEST_F(OutputReceiversTest, AStartBehindACommandOfAnotherMasterCounts) {
  managed.awaits_acknowledgements = true;
  managed.manager.boot_up(kAxis, now);
  order(nmt::Command::start);
  hand_out(nmt::Command::start, 3);
  hear(nmt::Command::stop);
  EXPECT_EQ(managed.manager.node(kAxis).state, nmt::State::stopped);
  receivers.acknowledged(3);
  EXPECT_EQ(managed.manager.node(kAxis).state, nmt::State::operational);
  EXPECT_EQ(receivers.state(kAxis), Receiver::started);
}

TEST_F(OutputReceiversTest, AStartThatTheBusLostIsNotSentAfterACommandOfAnotherMaster) {
  managed.awaits_acknowledgements = true;
  managed.manager.boot_up(kAxis, now);
  order(nmt::Command::start);
  hand_out(nmt::Command::start, 3);
  receivers.lost(3, 3);
  EXPECT_TRUE(managed.manager.starts(kAxis));
  hear(nmt::Command::stop);
  EXPECT_FALSE(managed.manager.starts(kAxis));
  receivers.advance(now);
  EXPECT_TRUE(started.empty());
}

TEST_F(OutputReceiversTest, AStartThatTheBusLostIsSentAgain) {
  heartbeat(nmt::State::operational, {});
  hand_out(nmt::Command::start, 3);
  receivers.lost(2, 4);
  EXPECT_EQ(receivers.state(kAxis), Receiver::waiting);
  host.set_usable(false);
  receivers.advance(now);
  EXPECT_TRUE(started.empty());
  host.set_usable(true);
  receivers.advance(now);
  EXPECT_EQ(started, std::vector<std::uint8_t>{kAxis});
  receivers.advance(now);
  EXPECT_EQ(started.size(), 1U);
}

}  // namespace
}  // namespace linegate::line
