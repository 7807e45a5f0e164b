// SPDX-License-Identifier: Apache-2.0
// NMT of a whole node: boot, commands, the services of each state, resets.
#include "tests/stack/node/node_fixture.h"

namespace linegate::node {
namespace {

using Frames = std::vector<Sent>;

TEST_F(NodeTest, SaysNothingBeforeItsStart) {
  hear(0ms, 0x000, {0x01, 0x00});
  hear(0ms, 0x605, {0x40, 0x00, 0x10, 0x00, 0, 0, 0, 0});
  EXPECT_TRUE(advance(10s).empty());
  EXPECT_EQ(node->state(), nmt::State::initialising);
}

TEST_F(NodeTest, BootsUpToPreOperational) {
  node->start(at(0ms));
  EXPECT_EQ(node->state(), nmt::State::pre_operational);
  EXPECT_EQ(drain(at(0ms)), (Frames{{at(0ms), 0x705, {0x00}}}));
  const auto told = testing::pop_events(events);
  ASSERT_EQ(told.size(), 1U);
  EXPECT_EQ(told[0].node, kNodeId);
  const auto& state = std::get<event::OwnState>(told[0].data);
  EXPECT_EQ(state.state, nmt::State::pre_operational);
  EXPECT_EQ(state.before, nmt::State::initialising);
  EXPECT_EQ(node->next_wake(), kNever);
}

class SelfStartingNodeTest : public NodeTest {
 protected:
  SelfStartingNodeTest() : NodeTest({kNodeId, true, true}) {}
};

TEST_F(SelfStartingNodeTest, GoesOperationalByItself) {
  node->start(at(0ms));
  EXPECT_EQ(node->state(), nmt::State::operational);
}

class MasterNodeTest : public NodeTest {
 protected:
  MasterNodeTest() : NodeTest({kNodeId, false, false}) {}
};

TEST_F(MasterNodeTest, ObeysItselfAndNotTheBus) {
  boot();
  nmt(0x01);
  EXPECT_EQ(node->state(), nmt::State::pre_operational);
  EXPECT_EQ(node->counters().unused, 1U);
  node->command(nmt::Command::start, at(1ms));
  EXPECT_EQ(node->state(), nmt::State::operational);
}

TEST_F(NodeTest, ObeysCommandsForItselfAndForAll) {
  boot();
  nmt(0x01, kNodeId);
  EXPECT_EQ(node->state(), nmt::State::operational);
  nmt(0x02, 0);
  EXPECT_EQ(node->state(), nmt::State::stopped);
  nmt(0x80, kNodeId + 1);
  EXPECT_EQ(node->state(), nmt::State::stopped);
  nmt(0x80, 0);
  EXPECT_EQ(node->state(), nmt::State::pre_operational);
}

TEST_F(NodeTest, SdoAnswersInPreOperationalAndOperationalOnly) {
  boot();
  EXPECT_EQ(sdo_write({0x2000, 1}, 2, 0x1234), 0U);
  nmt(0x01);
  EXPECT_EQ(sdo_write({0x2000, 1}, 2, 0x2345), 0U);
  nmt(0x02);
  EXPECT_EQ(sdo_write({0x2000, 1}, 2, 0x3456), std::nullopt);
  EXPECT_EQ(number(0x2000, 1), 0x2345U);
}

TEST_F(NodeTest, RpdosAreTakenInOperationalOnly) {
  boot();
  hear(1ms, 0x205, {0x01, 0x00});
  EXPECT_EQ(number(0x2000, 1), 0x1111U);
  nmt(0x01);
  hear(2ms, 0x205, {0x02, 0x00});
  EXPECT_EQ(number(0x2000, 1), 2U);
  nmt(0x02);
  hear(3ms, 0x205, {0x03, 0x00});
  EXPECT_EQ(number(0x2000, 1), 2U);
}

// A started node sends some PDOs only once, while the master still waits for other nodes (CiA
// 302-2).
TEST_F(NodeTest, AnNmtMasterTakesOnEnteringOperationalWhatCameInPreOperational) {
  boot();
  node->set_nmt_slave(false);
  node->command(nmt::Command::stop, at(1ms));
  hear(2ms, 0x205, {0x01, 0x00});
  node->command(nmt::Command::enter_pre_operational, at(3ms));
  node->command(nmt::Command::start, at(4ms));
  EXPECT_EQ(number(0x2000, 1), 0x1111U) << "nothing is kept in Stopped";
  node->command(nmt::Command::enter_pre_operational, at(5ms));
  hear(6ms, 0x205, {0x02, 0x00});
  hear(6ms, 0x305, {0x03, 0x00});
  EXPECT_EQ(number(0x2000, 1), 0x1111U);
  node->command(nmt::Command::start, at(7ms));
  EXPECT_EQ(number(0x2000, 1), 2U);
  EXPECT_EQ(number(0x2000, 2), 0x2222U) << "a synchronous RPDO waits for SYNC";
  hear(8ms, 0x080, {});
  EXPECT_EQ(number(0x2000, 2), 3U);
  node->command(nmt::Command::enter_pre_operational, at(9ms));
  hear(10ms, 0x205, {0x04, 0x00});
  node->command(nmt::Command::stop, at(11ms));
  node->command(nmt::Command::enter_pre_operational, at(12ms));
  node->command(nmt::Command::start, at(13ms));
  EXPECT_EQ(number(0x2000, 1), 2U) << "discarded in Stopped";
  node->command(nmt::Command::enter_pre_operational, at(14ms));
  hear(15ms, 0x205, {0x05, 0x00});
  node->set_nmt_slave(true);
  hear(16ms, 0x205, {0x06, 0x00});
  node->command(nmt::Command::start, at(17ms));
  EXPECT_EQ(number(0x2000, 1), 2U) << "a slave keeps no PDO";
  node->command(nmt::Command::enter_pre_operational, at(18ms));
  node->set_nmt_slave(false);
  hear(19ms, 0x205, {0x07, 0x00});
  node->command(nmt::Command::start, at(20ms));
  EXPECT_EQ(number(0x2000, 1), 7U) << "a master keeps PDOs";
}

TEST_F(NodeTest, TpdosAreSentInOperationalOnly) {
  boot();
  hear(1ms, 0x080, {});
  EXPECT_TRUE(drain(at(1ms)).empty());
  nmt(0x01);
  drain(at(1ms));
  hear(2ms, 0x080, {});
  EXPECT_EQ(drain(at(2ms)), (Frames{{at(2ms), 0x185, {0x11, 0x11}}}));
  nmt(0x02);
  hear(3ms, 0x080, {});
  EXPECT_TRUE(drain(at(3ms)).empty());
}

TEST_F(NodeTest, SyncIsNotServedInStopped) {
  boot();
  hear(1ms, 0x080, {});
  EXPECT_EQ(node->counters().syncs, 1U);
  nmt(0x02);
  hear(2ms, 0x080, {});
  EXPECT_EQ(node->counters().syncs, 1U);
}

TEST_F(NodeTest, EmcyIsNotSentInStopped) {
  boot();
  nmt(0x02);
  EXPECT_EQ(node->emcy().send(0x1000, 0x01, {}, at(1ms)), emcy::SendResult::disabled);
  EXPECT_TRUE(drain(at(1ms)).empty());
}

TEST_F(NodeTest, ResetCommunicationRestoresTheCommunicationArea) {
  boot_and_start();
  sdo_write({0x1017, 0}, 2, 100);
  sdo_write({0x2000, 1}, 2, 0x1234);
  nmt(0x82, kNodeId, 10ms);
  EXPECT_EQ(node->state(), nmt::State::pre_operational);
  EXPECT_EQ(number(0x1017, 0), 0U);
  EXPECT_EQ(number(0x2000, 1), 0x1234U);
  EXPECT_EQ(drain(at(10ms)), (Frames{{at(10ms), 0x705, {0x00}}}));
  EXPECT_EQ(node->next_wake(), kNever);
}

TEST_F(NodeTest, ResetNodeRestoresEverything) {
  boot_and_start();
  sdo_write({0x2000, 1}, 2, 0x1234);
  nmt(0x81, 0, 10ms);
  EXPECT_EQ(number(0x2000, 1), 0x1111U);
  EXPECT_EQ(drain(at(10ms)), (Frames{{at(10ms), 0x705, {0x00}}}));
  const auto told = testing::pop_events(events);
  ASSERT_EQ(told.size(), 2U);
  const auto& reset = std::get<event::OwnState>(told[0].data);
  EXPECT_EQ(reset.state, nmt::State::initialising);
  EXPECT_EQ(reset.before, nmt::State::operational);
  const auto& booted = std::get<event::OwnState>(told[1].data);
  EXPECT_EQ(booted.state, nmt::State::pre_operational);
  EXPECT_EQ(booted.before, nmt::State::initialising);
}

TEST_F(NodeTest, ASecondStartIsPowerOn) {
  boot_and_start();
  sdo_write({0x2000, 1}, 2, 0x1234);
  node->emcy().send(0x1000, 0x01, {}, at(1ms));
  node->start(at(20ms));
  EXPECT_EQ(node->state(), nmt::State::pre_operational);
  EXPECT_EQ(number(0x2000, 1), 0x1111U);
  EXPECT_EQ(number(0x1003, 0), 0U);
  EXPECT_EQ(drain(at(20ms)), (Frames{{at(20ms), 0x705, {0x00}}}));
}

struct Recorder : Application {
  void state_changed(nmt::State state, Instant /*now*/) override { states.push_back(state); }
  void reset(bool whole_node, Instant /*now*/) override { resets.push_back(whole_node); }
  void rpdo_received(std::uint16_t number, Instant /*now*/) override { rpdos.push_back(number); }

  std::vector<nmt::State> states;
  std::vector<bool> resets;
  std::vector<int> rpdos;
};

TEST_F(NodeTest, TheApplicationHearsOfAllThat) {  // PDO, PDO_SYNC
  Recorder application;
  node->set_application(&application);
  boot_and_start();
  hear(1ms, 0x205, {0x01, 0x00});
  nmt(0x82);
  nmt(0x81);
  using enum nmt::State;
  EXPECT_EQ(application.states, (std::vector<nmt::State>{pre_operational, operational,
                                                         pre_operational, pre_operational}));
  EXPECT_EQ(application.resets, (std::vector<bool>{false, true}));
  EXPECT_EQ(application.rpdos, (std::vector<int>{1}));
}

TEST(NodeDictionary, MandatoryObjectsAreAddedWhereMissing) {
  EventLog events;
  Node bare(od::Dictionary{}, {17, false, true}, events, nullptr);
  EXPECT_EQ(bare.dictionary().number({0x1000, 0}), 0U);
  EXPECT_EQ(bare.dictionary().number({0x1001, 0}), 0U);
  EXPECT_EQ(bare.dictionary().number({0x1014, 0}), 0x91U);
  EXPECT_EQ(bare.dictionary().number({0x1017, 0}), 0U);
  EXPECT_EQ(bare.dictionary().number({0x1018, 0}), 4U);
  Node given(testing::dictionary_of({testing::object(0x1000, od::DataType::unsigned32, 0x191)}),
             {17, false, true}, events, nullptr);
  EXPECT_EQ(given.dictionary().number({0x1000, 0}), 0x191U);
}

TEST_F(NodeTest, WhileSuspendedItSendsAndTakesNoPdoInAnyState) {
  boot_and_start();
  node->suspend(at(1ms));
  EXPECT_EQ(node->state(), nmt::State::operational);
  hear(2ms, 0x205, {0x05, 0x00});
  EXPECT_EQ(number(0x2000, 1), 0x1111U);
  EXPECT_FALSE(node->pdos().trigger(2, at(2ms)));
  nmt(0x82, kNodeId, 3ms);
  nmt(0x01, kNodeId, 4ms);
  drain(at(4ms));
  hear(5ms, 0x205, {0x06, 0x00});
  EXPECT_EQ(number(0x2000, 1), 0x1111U) << "also after a reset";
  EXPECT_TRUE(drain(at(5ms)).empty());
  node->resume();
  nmt(0x82, kNodeId, 6ms);
  nmt(0x01, kNodeId, 7ms);
  hear(8ms, 0x205, {0x07, 0x00});
  EXPECT_EQ(number(0x2000, 1), 7U);
}

TEST_F(NodeTest, WhileSuspendedItMissesNoHeartbeat) {
  boot();
  EXPECT_EQ(sdo_write({0x1016, 1}, 4, 0x0009'0064), 0U);
  hear(0ms, 0x709, {0x05});
  node->suspend(at(10ms));
  EXPECT_EQ(sdo_write({0x1016, 2}, 4, 0x000A'0064, 20ms), 0U);
  advance(20ms);
  hear(30ms, 0x70A, {0x05});
  testing::pop_events(events);
  EXPECT_TRUE(advance(10s).empty());
  EXPECT_TRUE(kinds().empty());
}

}  // namespace
}  // namespace linegate::node
