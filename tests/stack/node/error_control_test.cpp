// SPDX-License-Identifier: Apache-2.0
// Error control of a whole node and its consequences: guarding, 1029h, a duplicate node-ID, and the
// refusal of Operational by the application.
#include "tests/stack/node/node_fixture.h"

namespace linegate::node {
namespace {

using Frames = std::vector<Sent>;

class ErrorControlTest : public NodeTest {
 protected:
  ErrorControlTest() {
    od::Dictionary dictionary = example_dictionary();
    EXPECT_TRUE(dictionary.add(testing::object(0x100C, od::DataType::unsigned16, 0)).ok());
    EXPECT_TRUE(dictionary.add(testing::object(0x100D, od::DataType::unsigned8, 0)).ok());
    node =
        std::make_unique<Node>(std::move(dictionary), Options{.node_id = kNodeId}, events, nullptr);
  }

  Frames ask(Duration when, std::uint8_t length = 1) {
    can::Frame request = frame_at(at(when), 0x705, {});
    request.flags = can::Frame::kRemote;
    request.length = length;
    node->receive({&request, 1});
    return drain(at(when));
  }
};

TEST_F(ErrorControlTest, AnswersItsGuardInEveryState) {
  EXPECT_EQ(ask(0ms), Frames{}) << "the node is not started";
  boot();
  EXPECT_EQ(ask(1ms), (Frames{{at(1ms), 0x705, {0x7F}}}));
  nmt(0x01);
  drain(at(1ms));
  EXPECT_EQ(ask(2ms, 0), (Frames{{at(2ms), 0x705, {0x85}}}));
  nmt(0x02);
  EXPECT_EQ(ask(3ms), (Frames{{at(3ms), 0x705, {0x04}}}));
  nmt(0x82, kNodeId, 4ms);
  drain(at(4ms));
  EXPECT_EQ(ask(5ms), (Frames{{at(5ms), 0x705, {0x7F}}}));
}

TEST_F(ErrorControlTest, ALostGuardIsAnEmcyAndEndsOperational) {
  boot_and_start();
  EXPECT_EQ(sdo_write({0x100C, 0}, 2, 100), 0U);
  EXPECT_EQ(sdo_write({0x100D, 0}, 1, 3), 0U);
  ask(10ms);
  EXPECT_EQ(node->next_wake(), at(310ms));
  testing::pop_events(events);
  EXPECT_EQ(advance(310ms), (Frames{{at(310ms), 0x085, {0x30, 0x81, 0x11, 0, 0, 0, 0, 0}}}));
  EXPECT_EQ(node->state(), nmt::State::pre_operational);
  EXPECT_EQ(kinds(), (std::vector<EventKind>{EventKind::heartbeat_lost, EventKind::emcy_sent,
                                             EventKind::own_state}));
  const Frames back{{at(400ms), 0x085, {0, 0, 0, 0, 0, 0, 0, 0}}, {at(400ms), 0x705, {0xFF}}};
  EXPECT_EQ(ask(400ms), back);
}

TEST_F(ErrorControlTest, AHeartbeatWinsOverGuarding) {
  boot();
  sdo_write({0x100C, 0}, 2, 100);
  sdo_write({0x100D, 0}, 1, 3);
  sdo_write({0x1017, 0}, 2, 1000);
  EXPECT_EQ(ask(10ms), Frames{});
  EXPECT_EQ(node->next_wake(), at(1000ms));
  sdo_write({0x1017, 0}, 2, 0, 20ms);
  EXPECT_EQ(ask(30ms), (Frames{{at(30ms), 0x705, {0x7F}}}));
}

// Another device on the line also has node-ID 5.
TEST_F(ErrorControlTest, TheOwnNodeIdOfAnotherIsToldByItsBootUp) {
  boot_and_start();
  hear(1ms, 0x705, {0x00});
  const auto told = testing::pop_events(events);
  ASSERT_EQ(told.size(), 2U);
  EXPECT_EQ(told[0].node, kNodeId);
  EXPECT_EQ(told[0].data, EventData(event::DuplicateNodeId{nmt::State::initialising}));
  EXPECT_EQ(told[0].time, at(1ms));
  EXPECT_EQ(drain(at(1ms)), (Frames{{at(1ms), 0x085, {0x50, 0x81, 0x11, 0, 0, 0, 0, 0}}}));
  EXPECT_EQ(node->state(), nmt::State::operational);
  hear(2ms, 0x705, {0x00});
  EXPECT_EQ(kinds(), (std::vector<EventKind>{EventKind::duplicate_node_id}));
  EXPECT_TRUE(drain(at(2ms)).empty()) << "one EMCY only";
}

TEST_F(ErrorControlTest, OfItsHeartbeatsTheFirstIsTold) {
  boot();
  hear(1ms, 0x705, {0x85});
  const auto told = testing::pop_events(events);
  ASSERT_FALSE(told.empty());
  EXPECT_EQ(told[0].data, EventData(event::DuplicateNodeId{nmt::State::operational}));
  hear(2ms, 0x705, {0x05});
  EXPECT_TRUE(kinds().empty());
  nmt(0x82, kNodeId, 3ms);
  testing::pop_events(events);
  hear(4ms, 0x705, {0x05});
  EXPECT_EQ(kinds().front(), EventKind::duplicate_node_id) << "reported again after a reset";
}

// Two managers, one of them without a heartbeat: the EMCY is the only message of the other that it
// receives.
TEST_F(ErrorControlTest, AnEmcyOfAnotherWithTheOwnNodeIdIsToldOnce) {
  boot_and_start();
  hear(1ms, 0x085, {0x10, 0x10, 0x01, 0, 0, 0, 0, 0});
  const auto told = testing::pop_events(events);
  ASSERT_EQ(told.size(), 2U);
  EXPECT_EQ(told[0].node, kNodeId);
  EXPECT_EQ(told[0].data, EventData(event::DuplicateNodeId{nmt::State::unknown}));
  EXPECT_EQ(drain(at(1ms)), (Frames{{at(1ms), 0x085, {0x50, 0x81, 0x11, 0, 0, 0, 0, 0}}}));
  hear(2ms, 0x085, {0x50, 0x81, 0x11, 0, 0, 0, 0, 0});
  hear(3ms, 0x705, {0x05});
  EXPECT_TRUE(kinds().empty());
  EXPECT_TRUE(drain(at(3ms)).empty()) << "two managers must not answer endlessly";
  hear(4ms, 0x705, {0x00});
  EXPECT_EQ(kinds(), (std::vector<EventKind>{EventKind::duplicate_node_id}));
}

TEST_F(ErrorControlTest, TheOwnEmcyIsWhere1014hSays) {
  boot_and_start();
  const auto emcy_on = [this](Duration when, std::uint32_t id) {
    hear(when, id, {0x10, 0x10, 0x01, 0, 0, 0, 0, 0});
    return kinds();
  };
  EXPECT_EQ(sdo_write({0x1014, 0}, 4, 0x8000'0085), 0U);
  EXPECT_TRUE(emcy_on(1ms, 0x085).empty()) << "the own EMCY is invalid";
  EXPECT_EQ(sdo_write({0x1014, 0}, 4, 0x0F1), 0U);
  EXPECT_TRUE(emcy_on(2ms, 0x085).empty());
  EXPECT_EQ(sdo_write({0x1028, 7}, 4, 0x0F1), 0U);
  EXPECT_EQ(emcy_on(3ms, 0x0F1), (std::vector<EventKind>{EventKind::emcy}))
      << "node 7 has this COB-ID, too: no proof of a duplicate node-ID";
  EXPECT_EQ(sdo_write({0x1028, 7}, 4, 0x8000'00F1), 0U);
  hear(4ms, 0x0F1, {0x10, 0x10});
  EXPECT_EQ(kinds(), (std::vector<EventKind>{EventKind::malformed_frame}));
  EXPECT_EQ(emcy_on(5ms, 0x0F1).front(), EventKind::duplicate_node_id);
}

TEST_F(ErrorControlTest, ErrorBehaviourKnowsThreeValues) {
  boot();
  for (const std::uint32_t value : {0U, 1U, 2U}) {
    EXPECT_EQ(sdo_write({0x1029, 1}, 1, value), 0U);
  }
  for (const std::uint32_t value : {3U, 127U, 128U, 255U}) {
    EXPECT_EQ(sdo_write({0x1029, 1}, 1, value), 0x0609'0030U);
  }
}

TEST_F(ErrorControlTest, ErrorBehaviourInEveryState) {
  using enum nmt::State;
  struct Row {
    std::uint8_t behaviour;
    std::uint8_t command;
    nmt::State after;
  };
  const Row table[] = {{0, 0x01, pre_operational}, {0, 0x80, pre_operational}, {0, 0x02, stopped},
                       {1, 0x01, operational},     {1, 0x80, pre_operational}, {1, 0x02, stopped},
                       {2, 0x01, stopped},         {2, 0x80, stopped},         {2, 0x02, stopped}};
  boot();
  for (const Row& row : table) {
    nmt(0x80);
    EXPECT_EQ(sdo_write({0x1029, 1}, 1, row.behaviour), 0U);
    nmt(row.command);
    node->device_error(1, at(1ms));
    EXPECT_EQ(node->state(), row.after) << int{row.behaviour} << ' ' << int{row.command};
  }
}

TEST_F(ErrorControlTest, EachErrorClassHasItsOwnBehaviour) {
  od::Dictionary dictionary = example_dictionary();
  ASSERT_TRUE(dictionary.remove(0x1029).ok());
  ASSERT_TRUE(dictionary.add(testing::array(0x1029, od::DataType::unsigned8, 3, 1)).ok());
  node =
      std::make_unique<Node>(std::move(dictionary), Options{.node_id = kNodeId}, events, nullptr);
  boot_and_start();
  sdo_write({0x1029, 3}, 1, 2);
  node->device_error(2, at(1ms));
  EXPECT_EQ(node->state(), nmt::State::operational);
  node->device_error(3, at(1ms));
  EXPECT_EQ(node->state(), nmt::State::stopped);
  nmt(0x01);
  node->device_error(4, at(1ms));
  EXPECT_EQ(node->state(), nmt::State::pre_operational) << "as without 1029h";
}

struct Reluctant : Application {
  bool may_operate(Instant /*now*/) override {
    ++asked;
    return willing;
  }
  bool willing = false;
  int asked = 0;
};

TEST_F(ErrorControlTest, TheApplicationMayRefuseOperational) {
  Reluctant application;
  node->set_application(&application);
  boot();
  nmt(0x01);
  EXPECT_EQ(node->state(), nmt::State::pre_operational);
  EXPECT_EQ(node->counters().starts_refused, 1U);
  nmt(0x02);
  nmt(0x01, 0);
  EXPECT_EQ(node->state(), nmt::State::stopped) << "the state does not change";
  application.willing = true;
  nmt(0x01);
  EXPECT_EQ(node->state(), nmt::State::operational);
  nmt(0x01);
  EXPECT_EQ(application.asked, 3) << "already Operational";
  EXPECT_EQ(node->counters().starts_refused, 2U);
}

TEST(NmtStartup, BitsOf1F80hMakeASlaveStartItself) {
  using enum nmt::State;
  const std::pair<std::uint32_t, nmt::State> table[] = {{0x00, operational},
                                                        {0x04, pre_operational},
                                                        {0x01, pre_operational},
                                                        {0x05, pre_operational},
                                                        {0x08, operational}};
  for (const auto& [startup, state] : table) {
    EventLog events;
    Node node(testing::dictionary_of({testing::object(0x1F80, od::DataType::unsigned32, startup)}),
              {.node_id = 9}, events, nullptr);
    node.start(at(0ms));
    EXPECT_EQ(node.state(), state) << startup;
    Node master(
        testing::dictionary_of({testing::object(0x1F80, od::DataType::unsigned32, startup)}),
        {.node_id = 9, .nmt_slave = false}, events, nullptr);
    master.start(at(0ms));
    EXPECT_EQ(master.state(), pre_operational) << "its owner decides";
  }
  EventLog events;
  Node plain(od::Dictionary{}, {.node_id = 9}, events, nullptr);
  plain.start(at(0ms));
  EXPECT_EQ(plain.state(), pre_operational) << "without the object";
}

}  // namespace
}  // namespace linegate::node
