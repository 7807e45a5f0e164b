// SPDX-License-Identifier: Apache-2.0
// A line beside a foreign master: the test simulates the bus.
#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <span>
#include <vector>

#include "stack/base/byte_order.h"
#include "stack/nmt/heartbeat_consumer.h"

#include "tests/stack/line/observer_fixture.h"

namespace linegate::line {
namespace {

using testing::ElementsAre;

LineConfig talkative() {
  LineConfig config = config_with_axis();
  config.sync_period = milliseconds(10);
  config.time_period = milliseconds(100);
  config.heartbeat = milliseconds(100);
  config.nodes[0].pdo_deadline = milliseconds(50);
  config.defaults = {{0, 7}, {1, 1}};
  return config;
}

TEST_F(ObserverTest, TransmitsNothingWhateverIsHeard) {
  observe(talkative());
  expect_silence();
  for (std::uint32_t id = 0; id < 0x800; ++id) {
    for (const std::uint8_t first :
         std::initializer_list<std::uint8_t>{0x00, 0x01, 0x05, 0x23, 0x40, 0x81, 0xC2, 0xFF}) {
      hear(id, {first, 0x00, 0x10, 0x00, 0, 0, 0, 0});
    }
    hear(id, {});
    hear(id, {0x7F});
    hear(id, {0x82, 0x00});
    hear_remote(id);
    expect_silence();
    events();
  }
}

TEST_F(ObserverTest, TransmitsNothingWhateverTimeBrings) {
  observe(talkative());
  hear(0x705, {0x05});
  hear(0x185, {1, 2, 3, 4, 5, 6});
  for (int second = 0; second < 3600; ++second) {
    pass(seconds(1));
    hear(0x080, {});
    expect_silence();
    events();
  }
  for (const can::BusState state :
       {can::BusState::bus_off, can::BusState::error_active, can::BusState::absent}) {
    line_->bus_event({.kind = can::BusEvent::Kind::state, .state = state, .time = now_});
    expect_silence();
  }
  line_->stop(now_);
  expect_silence();
}

TEST_F(ObserverTest, RefusesWhatWouldTransmit) {
  observe(talkative());
  events();
  for (const CommandKind asked : kRequestKinds) {
    if (asked == CommandKind::can_listen) {
      continue;
    }
    const std::uint64_t tag = static_cast<std::uint64_t>(asked) + 1;
    now_ += std::chrono::seconds(2);  // refusals are limited in a second
    line_->execute({.tag = tag, .request = empty_request(asked)}, now_);
    expect_silence();
    const Reply reply = answer();
    EXPECT_EQ(reply.tag, tag);
    EXPECT_EQ(reply.error, to_error(Refusal::wrong_role)) << name(asked);
    const std::vector<Event> refused = of(EventKind::command_refused);
    ASSERT_EQ(refused.size(), 1U) << name(asked);
    EXPECT_EQ(std::get<event::CommandRefused>(refused[0].data).refusal, Refusal::wrong_role);
  }
  OutputWrite write{.layout_id = line_->layout(Direction::outputs).id, .arming = 1};
  write.values.push_back({.entry = 0, .length = 4});
  EXPECT_EQ(line_->write_outputs(write, now_), OutputRefusal::wrong_role);
  expect_silence();
  const std::vector<Event> refused = of(EventKind::output_refused);
  ASSERT_EQ(refused.size(), 1U);
  EXPECT_EQ(std::get<event::OutputRefused>(refused[0].data).refusal, OutputRefusal::wrong_role);
  EXPECT_EQ(line_->state().counters.output_writes_refused, 1U);
  EXPECT_FALSE(line_->request_pdo(1));
  expect_silence();
}

TEST_F(ObserverTest, HasTheLayoutOfTheManager) {
  make(config_with_axis());
  const std::uint64_t inputs = line_->layout(Direction::inputs).id;
  const std::uint64_t outputs = line_->layout(Direction::outputs).id;
  make(observed(config_with_axis()));
  EXPECT_EQ(line_->layout(Direction::inputs).id, inputs);
  EXPECT_EQ(line_->layout(Direction::outputs).id, outputs);
  EXPECT_EQ(line_->layout(Direction::outputs).direction, Direction::outputs);
  EXPECT_EQ(snapshot(Direction::inputs).layout_id, inputs);
  EXPECT_EQ(snapshot(Direction::outputs).layout_id, outputs);
  EXPECT_EQ(snapshot(Direction::outputs).direction, Direction::outputs);
}

TEST_F(ObserverTest, WhatTheMasterSendsIsTheOutputs) {
  observe(config_with_axis());
  EXPECT_FALSE(snapshot(Direction::outputs).is_valid(0));
  hear(0x205, {1, 2, 3, 4, 5});
  EXPECT_TRUE(line_->image_changed(Direction::outputs));
  EXPECT_FALSE(line_->image_changed(Direction::inputs));
  const image::Snapshot outputs = snapshot(Direction::outputs);
  EXPECT_THAT(numbers(outputs), ElementsAre(1, 2, 3, 4, 5));
  EXPECT_TRUE(outputs.is_valid(0));
  EXPECT_TRUE(outputs.is_valid(1));
  ASSERT_EQ(outputs.marks.size(), 1U);
  EXPECT_EQ(outputs.marks[0].node, 5);
  EXPECT_EQ(outputs.marks[0].time, now_);
}

TEST_F(ObserverTest, WhatTheDevicesSendIsTheInputs) {
  observe(config_with_axis());
  hear(0x185, {0x11, 0x22, 1, 2, 3, 4});
  const image::Snapshot inputs = snapshot(Direction::inputs);
  const auto& entries = line_->layout(Direction::inputs).entries;
  ASSERT_EQ(entries.size(), 2U);
  EXPECT_EQ(inputs.bytes[entries[0].bit_offset / 8], std::byte{0x11});
  EXPECT_EQ(inputs.bytes[entries[1].bit_offset / 8], std::byte{1});
  EXPECT_TRUE(inputs.is_valid(0));
  const LineState state = line_->state();
  EXPECT_EQ(state.role, Role::observer);
  EXPECT_EQ(state.node_id, 0);
  EXPECT_EQ(state.counters.rpdos, 1U);
  EXPECT_EQ(state.counters.frames_received, 1U);
  EXPECT_EQ(state.counters.frames_sent, 0U);
}

TEST_F(ObserverTest, ANodeThatSaysNothingElseIsOperationalWithItsFirstPdo) {
  LineConfig config = config_with_axis();
  config.nodes[0].heartbeat = Duration{};
  observe(config);
  EXPECT_EQ(line_->node_state(5).presence, Presence::unknown);
  const std::uint64_t before = line_->node_revision(5);
  hear(0x185, {0x11, 0x22, 1, 2, 3, 4});
  EXPECT_EQ(line_->node_state(5).presence, Presence::present);
  EXPECT_EQ(line_->node_state(5).state, nmt::State::operational);
  EXPECT_GT(line_->node_revision(5), before);
  EXPECT_EQ(line_->state().nodes_operational, 1);
}

TEST_F(ObserverTest, HeartbeatsTellStateLossAndReturn) {
  observe(config_with_axis());
  hear(0x705, {0x00});
  EXPECT_EQ(line_->node_state(5).state, nmt::State::pre_operational);
  EXPECT_TRUE(emitted(EventKind::boot_up, 5));
  hear(0x705, {0x05});
  EXPECT_EQ(line_->node_state(5).state, nmt::State::operational);
  EXPECT_TRUE(line_->node_state(5).heartbeat_monitored);
  hear(0x185, {1, 2, 3, 4, 5, 6});
  EXPECT_TRUE(snapshot(Direction::inputs).is_valid(0));
  pass(milliseconds(250));
  EXPECT_EQ(line_->node_state(5).presence, Presence::missing);
  EXPECT_FALSE(snapshot(Direction::inputs).is_valid(0));
  EXPECT_TRUE(emitted(EventKind::heartbeat_lost, 5));
  EXPECT_EQ(line_->state().counters.heartbeats_lost, 1U);
  hear(0x705, {0x05});
  EXPECT_EQ(line_->node_state(5).presence, Presence::present);
  EXPECT_TRUE(emitted(EventKind::heartbeat_recovered, 5));
}

TEST_F(ObserverTest, CommandsOfTheMasterAreToldAndBelievedWhereNothingElseTellsTheState) {
  LineConfig config = config_with_axis();
  config.nodes[0].heartbeat = Duration{};
  observe(config);
  hear(0x705, {0x00});
  events();
  hear(0x000, {0x01, 0x05});
  EXPECT_EQ(line_->node_state(5).state, nmt::State::operational);
  std::vector<Event> told = of(EventKind::nmt_command);
  ASSERT_EQ(told.size(), 1U);
  EXPECT_EQ(told[0].node, 5);
  EXPECT_EQ(told[0].data, EventData(event::NmtCommand{nmt::Command::start}));
  hear(0x185, {1, 2, 3, 4, 5, 6});
  EXPECT_TRUE(snapshot(Direction::inputs).is_valid(0));
  hear(0x000, {0x02, 0x00});
  EXPECT_EQ(line_->node_state(5).state, nmt::State::stopped);
  EXPECT_FALSE(snapshot(Direction::inputs).is_valid(0));
  hear(0x000, {0x03, 0x00});
  EXPECT_EQ(of(EventKind::malformed_frame).size(), 1U);
}

TEST_F(ObserverTest, ANodeThatWasResetTakesNoCommandBeforeItsBootUpMessage) {
  LineConfig config = config_with_axis();
  config.nodes[0].heartbeat = Duration{};
  observe(config);
  hear(0x705, {0x00});
  hear(0x000, {0x81, 0x05});
  EXPECT_EQ(line_->node_state(5).state, nmt::State::unknown);
  hear(0x000, {0x01, 0x00});
  EXPECT_EQ(line_->node_state(5).state, nmt::State::unknown);
  hear(0x705, {0x00});
  hear(0x000, {0x01, 0x00});
  EXPECT_EQ(line_->node_state(5).state, nmt::State::operational);
}

TEST_F(ObserverTest, AnswersToAGuardingMasterAreHeartbeats) {
  LineConfig config = config_with_axis();
  config.nodes[0].heartbeat = Duration{};
  config.nodes[0].guard_time = milliseconds(100);
  config.nodes[0].life_time_factor = 2;
  observe(config);
  hear(0x705, {0x00});
  pass(seconds(1));
  EXPECT_TRUE(of(EventKind::heartbeat_lost).empty()) << "no guarding request was sent yet";
  for (const unsigned toggle : {0x00U, 0x80U, 0x00U, 0x80U}) {
    hear_remote(0x705);
    hear(0x705, {static_cast<std::uint8_t>(toggle | 5U)});
    pass(milliseconds(100));
  }
  EXPECT_EQ(line_->node_state(5).state, nmt::State::operational);
  EXPECT_EQ(line_->state().counters.frames_unused, 0U);
  hear(0x705, {0xFF});
  EXPECT_EQ(line_->node_state(5).state, nmt::State::operational) << "the toggle bit did not change";
  EXPECT_EQ(line_->state().counters.frames_unused, 1U);
  EXPECT_EQ(line_->state().counters.frames_malformed, 0U);
  events();
  pass(milliseconds(100));
  const std::vector<Event> lost = of(EventKind::heartbeat_lost);
  ASSERT_EQ(lost.size(), 1U);
  EXPECT_EQ(std::get<event::HeartbeatLost>(lost[0].data).by, event::ErrorControl::node_guarding);
  EXPECT_EQ(line_->node_state(5).presence, Presence::missing);
}

TEST_F(ObserverTest, ANodeThatIsGuardedUnexpectedlyIsUnderstoodFromTheFirstRequest) {
  LineConfig config = config_with_axis();
  config.nodes[0].heartbeat = Duration{};
  observe(config);
  hear_remote(0x705);
  hear(0x705, {0x85});
  hear_remote(0x705);
  hear(0x705, {0x05});
  EXPECT_EQ(line_->node_state(5).state, nmt::State::operational);
  EXPECT_EQ(line_->state().counters.frames_malformed, 0U);
  pass(seconds(100));
  EXPECT_EQ(line_->node_state(5).presence, Presence::missing) << "no more guard responses";
}

TEST_F(ObserverTest, EmcysAndForeignNodesAreTold) {
  LineConfig config = observed(config_with_axis());
  config.node_id = 126;  // the node-ID of the master
  make(config);
  line_->start(now_);
  hear(0x085, {0x10, 0x81, 0x11, 1, 2, 3, 4, 5});
  EXPECT_EQ(line_->node_state(5).last_emcy, 0x8110);
  EXPECT_EQ(line_->node_state(5).presence, Presence::present);
  EXPECT_TRUE(emitted(EventKind::emcy, 5));
  hear(0x77E, {0x05});
  EXPECT_FALSE(emitted(EventKind::unexpected_node, 126)) << "126 is the master";
  hear(0x709, {0x05});
  hear(0x709, {0x05});
  EXPECT_EQ(of(EventKind::unexpected_node).size(), 1U);
  EXPECT_EQ(line_->node_state(9).state, nmt::State::operational);
}

TEST_F(ObserverTest, TheSyncAndTheTimeOfOthersCount) {
  observe(config_with_axis());
  hear(0x080, {});
  hear(0x080, {7});
  EXPECT_EQ(line_->sync_count(), 2U);
  EXPECT_FALSE(line_->network_utc(now_));
  hear(0x100, {0, 0, 0, 0, 1, 0});
  ASSERT_TRUE(line_->network_utc(now_));
  EXPECT_EQ(*line_->network_utc(now_), std::chrono::hours(24) * 5114);
}

TEST_F(ObserverTest, WithoutABusNothingIsValid) {
  observe(config_with_axis());
  hear(0x185, {1, 2, 3, 4, 5, 6});
  hear(0x205, {1, 2, 3, 4, 5});
  line_->bus_event({.kind = can::BusEvent::Kind::interface_failed, .code = 19, .time = now_});
  EXPECT_FALSE(snapshot(Direction::inputs).is_valid(0));
  EXPECT_FALSE(snapshot(Direction::outputs).is_valid(0));
  EXPECT_TRUE(emitted(EventKind::interface_failed));
}

TEST_F(ObserverTest, APdoThatStaysAwayIsTold) {
  LineConfig config = config_with_axis();
  config.nodes[0].pdo_deadline = milliseconds(50);
  observe(config);
  hear(0x185, {1, 2, 3, 4, 5, 6});
  pass(milliseconds(60));
  EXPECT_TRUE(emitted(EventKind::pdo_timeout, 5));
  hear(0x185, {1, 2, 3, 4, 5, 6});
  EXPECT_TRUE(emitted(EventKind::pdo_recovered, 5));
  hear(0x185, {1, 2});
  EXPECT_TRUE(emitted(EventKind::pdo_length, 5));
  EXPECT_EQ(line_->state().counters.frames_malformed, 1U);
}

}  // namespace
}  // namespace linegate::line
