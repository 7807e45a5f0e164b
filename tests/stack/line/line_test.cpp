// SPDX-License-Identifier: Apache-2.0
// The line of a manager, byte by byte: the test simulates the device.
#include <map>

#include "stack/base/byte_order.h"
#include "stack/od/dictionary.h"
#include "stack/storage/medium.h"

#include "tests/stack/line/line_fixture.h"

namespace linegate::line {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

TEST_F(LineTest, BootsANodeStepByStep) {
  make(config_with_axis());
  line_->start(now_);
  EXPECT_THAT(sent(), ElementsAre("000#8200", "77F#00"));
  hear(0x705, {0x00});
  EXPECT_THAT(sent(), ElementsAre("605#4000100000000000"));
  hear(0x585, {0x43, 0x00, 0x10, 0x00, 0x92, 0x01, 0x02, 0x00});
  EXPECT_THAT(sent(), ElementsAre("605#4018100100000000"));
  hear(0x585, {0x43, 0x18, 0x10, 0x01, 0x23, 0x01, 0x00, 0x00});
  EXPECT_THAT(sent(), ElementsAre("605#4018100200000000"));
  hear(0x585, {0x43, 0x18, 0x10, 0x02, 0x42, 0x00, 0x00, 0x00});
  EXPECT_THAT(sent(), ElementsAre("605#4018100400000000")) << "reads the serial number";
  hear(0x585, {0x80, 0x18, 0x10, 0x04, 0x11, 0x00, 0x09, 0x06});
  EXPECT_THAT(sent(), ElementsAre("605#4000180100000000")) << "reads the PDOs of the image";
  hear(0x585, {0x43, 0x00, 0x18, 0x01, 0x85, 0x01, 0x00, 0x00});
  hear_no_pdo_records();
  EXPECT_THAT(sent(), ElementsAre("605#2B17100064000000")) << "writes the heartbeat, 100 ms";
  hear(0x585, {0x60, 0x17, 0x10, 0x00, 0, 0, 0, 0});
  EXPECT_THAT(sent(), ElementsAre());
  hear(0x705, {0x7F});
  EXPECT_THAT(sent(), ElementsAre("000#0105"));
  hear(0x705, {0x05});
  const NodeState node = line_->node_state(5);
  EXPECT_EQ(node.boot, manager::kBooted);
  EXPECT_EQ(node.state, nmt::State::operational);
  EXPECT_EQ(node.presence, Presence::present);
  EXPECT_EQ(node.vendor, 0x123U);
  EXPECT_EQ(line_->state().manager, ManagerState::running);
  EXPECT_EQ(line_->state().nodes_operational, 1);
  EXPECT_TRUE(emitted(EventKind::boot_result, 5));
}

TEST_F(LineTest, AWrongDeviceIsNotStartedAndSaysWhy) {
  make(config_with_axis());
  line_->start(now_);
  hear(0x705, {0x00});
  hear(0x585, {0x43, 0x00, 0x10, 0x00, 0x91, 0x01, 0x0F, 0x00});
  EXPECT_EQ(line_->node_state(5).boot, 'C');
  EXPECT_EQ(line_->node_state(5).device_type, 0xF0191U);
  EXPECT_TRUE(emitted(EventKind::boot_result, 5));
  sent();
  pass(seconds(3));
  for (const std::string& frame : sent()) {
    EXPECT_NE(frame, "000#0105");
  }
}

TEST_F(LineTest, AConfigurationThatIsRefusedNamesTheObject) {
  make(config_with_axis());
  line_->start(now_);
  hear(0x705, {0x00});
  hear(0x585, {0x43, 0x00, 0x10, 0x00, 0x92, 0x01, 0x02, 0x00});
  hear(0x585, {0x43, 0x18, 0x10, 0x01, 0x23, 0x01, 0x00, 0x00});
  hear(0x585, {0x43, 0x18, 0x10, 0x02, 0x42, 0x00, 0x00, 0x00});
  hear_no_serial_number();
  hear_no_pdo_records();
  events();
  hear(0x585, {0x80, 0x17, 0x10, 0x00, 0x00, 0x00, 0x02, 0x06});
  const std::vector<Event> all = events();
  const auto error = std::ranges::find(all, EventKind::configuration_error, &Event::kind);
  ASSERT_NE(error, all.end());
  EXPECT_EQ(error->node, 5);
  EXPECT_EQ(std::get<event::ConfigurationError>(error->data).abort, AbortCode::no_object);
  EXPECT_EQ(std::get<event::ConfigurationError>(error->data).index, 0x1017U);
  EXPECT_EQ(line_->node_state(5).boot, 'J');
}

TEST_F(LineTest, AReceivedPdoIsInTheImageAndInTheNetworkVariables) {
  make(config_with_axis());
  boot();
  hear(0x185, {0x34, 0x12, 0x78, 0x56, 0x34, 0x12});
  const image::Layout& layout = line_->layout(Direction::inputs);
  ASSERT_EQ(layout.entries.size(), 2U);
  EXPECT_EQ(layout.entries[0].name, "axis.Status");
  EXPECT_EQ(layout.entries[1].bit_offset % 32, 0U) << "numeric entries are aligned to their size";
  EXPECT_EQ(layout.entries[1].profile, 0x192);
  const image::Snapshot seen = snapshot(Direction::inputs);
  const auto value = [&](std::size_t i) {
    const image::Entry& e = layout.entries[i];
    return load_le(std::span(seen.bytes).subspan(e.bit_offset / 8, e.bit_length / 8U));
  };
  EXPECT_EQ(value(0), 0x1234U);
  EXPECT_EQ(value(1), 0x12345678U);
  EXPECT_TRUE(seen.is_valid(0) && seen.is_valid(1) && seen.is_changed(0) && seen.is_changed(1));
  ASSERT_EQ(seen.marks.size(), 1U);
  EXPECT_EQ(seen.marks[0].node, 5);
  EXPECT_EQ(seen.marks[0].count, 1U);
  for (const image::Entry& entry : layout.entries) {
    ASSERT_NE(entry.variable_sub, 0);
    Command read{
        .tag = 9,
        .request = LocalRead{.what = od::Address{entry.variable_index, entry.variable_sub}}};
    line_->execute(read, now_);
    const Reply reply = answer();
    ASSERT_TRUE(reply.ok());
    EXPECT_TRUE(std::ranges::equal(
        reply.bytes(), std::span(seen.bytes).subspan(entry.bit_offset / 8, entry.bit_length / 8U)));
  }
}

TEST_F(LineTest, AdvanceTellsWhetherInputsMayHaveChanged) {
  LineConfig config = config_with_axis();
  config.nodes[0].pdo_deadline = milliseconds(50);
  make(std::move(config));
  boot();
  EXPECT_TRUE(line_->advance(now_));
  hear(0x185, {1, 0, 2, 0, 0, 0});
  pass(milliseconds(1));
  (void)line_->next_wake();
  EXPECT_FALSE(line_->advance(now_)) << "nothing is due, and nothing was received";
  EXPECT_FALSE(line_->input(0).late);
  now_ += milliseconds(50);
  EXPECT_TRUE(line_->advance(now_));
  EXPECT_TRUE(line_->input(0).late) << "its deadline has passed";
  hear(0x185, {1, 0, 2, 0, 0, 0});
  hear(0x705, {0x05});
  EXPECT_TRUE(line_->advance(now_)) << "a heartbeat was received";
  line_->bus_event({.kind = can::BusEvent::Kind::interface_failed, .time = now_});
  EXPECT_TRUE(line_->advance(now_));
  EXPECT_FALSE(line_->input(0).valid);
}

TEST_F(LineTest, ADeviceIsAskedForItsPdoWithARemoteFrame) {
  make(config_with_axis());
  EXPECT_FALSE(line_->request_pdo(1)) << "the line is not started";
  boot();
  EXPECT_FALSE(line_->request_pdo(2));
  EXPECT_TRUE(line_->request_pdo(1));
  can::Frame frame;
  ASSERT_TRUE(line_->next_frame(frame, now_));
  EXPECT_TRUE(frame.remote());
  EXPECT_EQ(frame.id, 0x185U);
  EXPECT_EQ(frame.length, 6);
}

TEST_F(LineTest, ALostHeartbeatInvalidatesTheValuesAndResetsTheNode) {
  make(config_with_axis());
  boot();
  hear(0x185, {1, 0, 2, 0, 0, 0});
  EXPECT_TRUE(snapshot(Direction::inputs).is_valid(0));
  sent();
  pass(milliseconds(249));
  EXPECT_FALSE(emitted(EventKind::heartbeat_lost, 5));
  pass(milliseconds(1));
  EXPECT_TRUE(emitted(EventKind::heartbeat_lost, 5));
  EXPECT_EQ(line_->node_state(5).presence, Presence::missing);
  EXPECT_FALSE(snapshot(Direction::inputs).is_valid(0));
  EXPECT_THAT(sent(), testing::Contains("000#8105"));
  pass(seconds(2));
  EXPECT_THAT(sent(), testing::Contains("605#4000100000000000")) << "the device type is requested";
  hear(0x705, {0x00});
  EXPECT_TRUE(emitted(EventKind::boot_up, 5));
  EXPECT_EQ(line_->node_state(5).presence, Presence::present);
}

TEST_F(LineTest, ALateThreadReportsNoLossThatDidNotHappen) {
  make(config_with_axis());
  boot();
  events();
  const Instant booted = now_;
  now_ = booted + seconds(2);  // the thread was suspended, the heartbeats are in the socket
  std::vector<can::Frame> waiting;
  for (int i = 1; i <= 20; ++i) {
    waiting.push_back(can::make_frame(0x705, {0x05}));
    waiting.back().time = booted + i * milliseconds(100);
  }
  line_->receive(waiting, now_);
  line_->advance(now_);
  EXPECT_FALSE(emitted(EventKind::heartbeat_lost, 5));
}

TEST_F(LineTest, AnOutputPdoWaitsForAllOfItsEntries) {
  make(config_with_axis());
  boot();
  sent();
  const std::uint64_t layout = line_->layout(Direction::outputs).id;
  OutputWrite write{.group = 0, .layout_id = layout};
  write.values = {{.entry = 0, .length = 4, .data = {std::byte{0x10}}}};
  EXPECT_EQ(line_->write_outputs(write, now_), OutputRefusal::none);
  EXPECT_THAT(sent(), ElementsAre());
  write.values = {{.entry = 1, .length = 1, .data = {std::byte{0x07}}}};
  EXPECT_EQ(line_->write_outputs(write, now_), OutputRefusal::none);
  EXPECT_THAT(sent(), ElementsAre("205#1000000007"));
  EXPECT_EQ(line_->write_outputs(write, now_), OutputRefusal::none);
  EXPECT_THAT(sent(), ElementsAre()) << "nothing changed";
}

TEST_F(LineTest, ADefaultStandsInForAnEntryNobodyWrites) {
  LineConfig config = config_with_axis();
  config.defaults = {{.entry = 1, .value = 3}};
  make(std::move(config));
  boot();
  sent();
  OutputWrite write{.group = 0, .layout_id = line_->layout(Direction::outputs).id};
  write.values = {{.entry = 0, .length = 4, .data = {std::byte{0x10}}}};
  line_->write_outputs(write, now_);
  EXPECT_THAT(sent(), ElementsAre("205#1000000003"));
}

TEST_F(LineTest, OneWriteIsOneFrame) {
  make(config_with_axis());
  boot();
  sent();
  OutputWrite write{.group = 0, .layout_id = line_->layout(Direction::outputs).id};
  write.values = {{.entry = 0, .length = 4, .data = {std::byte{1}}},
                  {.entry = 1, .length = 1, .data = {std::byte{2}}}};
  line_->write_outputs(write, now_);
  EXPECT_THAT(sent(), ElementsAre("205#0100000002"));
  write.values.clear();
  write.bytes = {{.offset = 0, .data = std::vector<std::byte>(5, std::byte{9})}};
  EXPECT_EQ(line_->write_outputs(write, now_), OutputRefusal::none);
  EXPECT_THAT(sent(), ElementsAre("205#0909090909"));
  EXPECT_EQ(line_->state().counters.tpdos_coalesced, 0U);
}

// After a reaction no write is applied until the group is armed again; a writer that missed it
// continues to write.
TEST_F(LineTest, ARefusedWriterThatGoesOnIsToldOnceASecond) {
  make(config_with_axis());
  line_->start(now_);
  OutputWrite write{.group = 0, .layout_id = line_->layout(Direction::outputs).id};
  write.arming = 7;
  write.watchdog = milliseconds(100);
  ASSERT_EQ(line_->write_outputs(write, now_), OutputRefusal::none);
  pass(milliseconds(200));
  events();
  std::vector<Event> refused;
  for (int i = 0; i < 250; ++i) {
    EXPECT_EQ(line_->write_outputs(write, now_), OutputRefusal::not_armed);
    pass(milliseconds(10));
    std::ranges::copy_if(events(), std::back_inserter(refused), [](const Event& event) {
      return event.kind() == EventKind::output_refused;
    });
  }
  ASSERT_EQ(refused.size(), 3U) << "events at 0, 1 and 2 s";
  EXPECT_EQ(std::get<event::OutputRefused>(refused[1].data).suppressed, 98U)
      << "98 others were suppressed";
  EXPECT_EQ(line_->state().counters.output_writes_refused, 250U) << "each write is counted";
}

TEST_F(LineTest, ARefusedCommandIsAnsweredEachTimeAndToldOnceASecond) {
  make(config_with_axis());
  line_->start(now_);
  pass(milliseconds(10));
  events();
  const Command unknown{.tag = 1, .request = SingleOutput{.entry = 99}};
  unsigned told = 0;
  for (int i = 0; i < 150; ++i) {
    line_->execute(unknown, now_);
    EXPECT_EQ(answer().error, to_error(Refusal::unknown_entry));
    pass(milliseconds(10));
    told += static_cast<unsigned>(
        std::ranges::count(events(), EventKind::command_refused, &Event::kind));
  }
  EXPECT_EQ(told, 2U) << "events at 0 and 1 s";
}

TEST_F(LineTest, CommandsAreAnsweredOnceEach) {
  make(config_with_axis());
  boot();
  sent();
  line_->execute({.tag = 1, .request = SdoRead{.node = 5, .address = {0x2000, 0}}}, now_);
  EXPECT_THAT(sent(), ElementsAre("605#4000200000000000"));
  hear(0x585, {0x4B, 0x00, 0x20, 0x00, 0xCD, 0xAB, 0, 0});
  Reply reply = answer();
  EXPECT_EQ(reply.tag, 1U);
  EXPECT_THAT(reply.bytes(), ElementsAre(std::byte{0xCD}, std::byte{0xAB}));

  line_->execute({.tag = 2, .request = SdoRead{.node = 5, .address = {0x3000, 0}}}, now_);
  hear(0x585, {0x80, 0x00, 0x30, 0x00, 0x00, 0x00, 0x02, 0x06});
  reply = answer();
  EXPECT_EQ(reply.error, to_error(AbortCode::no_object));

  events();
  line_->execute({.tag = 3, .request = NmtRequest{.node = 200}}, now_);
  EXPECT_TRUE(emitted(EventKind::command_refused, 0)) << "there is no node 200 to tell of";
  EXPECT_EQ(answer().error, to_error(Refusal::bad_request));
  line_->execute({.tag = 4, .request = SdoRead{.node = 0}}, now_);
  EXPECT_EQ(answer().error, to_error(Refusal::bad_request));
  line_->execute({.tag = 5, .request = SingleOutput{.entry = 99}}, now_);
  EXPECT_EQ(answer().error, to_error(Refusal::unknown_entry));
  line_->execute({.tag = 6, .request = LocalRead{.what = od::Address{0x1018, 9}}}, now_);
  EXPECT_EQ(answer().error, to_error(AbortCode::no_sub_index));
  Reply none;
  EXPECT_FALSE(line_->pop_reply(none));
}

TEST_F(LineTest, ANetworkIsThatOfTheLineOrThereIsNoRouteToIt) {
  LineConfig config = config_with_axis();
  config.network_id = 3;
  make(config);
  boot();
  sent();
  Command read{.tag = 1, .request = NetworkRead{.network = 3, .node = 5, .address = {0x2000, 0}}};
  line_->execute(read, now_);
  EXPECT_THAT(sent(), ElementsAre("605#4000200000000000"));
  hear(0x585, {0x4B, 0x00, 0x20, 0x00, 0xCD, 0xAB, 0, 0});
  EXPECT_THAT(answer().bytes(), ElementsAre(std::byte{0xCD}, std::byte{0xAB}));
  std::get<NetworkRead>(read.request).network = 4;
  line_->execute(read, now_);
  EXPECT_EQ(answer().error, to_error(AbortCode::invalid_value));
  EXPECT_TRUE(sent().empty());
}

TEST_F(LineTest, ACommandsOwnTimeOutEndsIt) {
  make(config_with_axis());
  boot();
  line_->execute({.tag = 1,
                  .timeout = milliseconds(50),
                  .request = SdoRead{.node = 5, .address = {0x2000, 0}}},
                 now_);
  pass(milliseconds(50));
  const Reply reply = answer();
  EXPECT_FALSE(reply.ok());
  hear(0x585, {0x4B, 0x00, 0x20, 0x00, 0xCD, 0xAB, 0, 0});
  Reply none;
  EXPECT_FALSE(line_->pop_reply(none)) << "a late response causes no reply";
}

TEST_F(LineTest, ATimeOutBeyondTheEndOfTimeIsNotOver) {
  make(config_with_axis());
  boot();
  line_->execute(
      {.tag = 1, .timeout = Duration::max(), .request = SdoRead{.node = 5, .address = {0x2000, 0}}},
      now_);
  pass(milliseconds(50));
  hear(0x585, {0x4B, 0x00, 0x20, 0x00, 0xCD, 0xAB, 0, 0});
  EXPECT_TRUE(answer().ok());
}

TEST_F(LineTest, AFullQueueSaysBusyAndKeepsTheRest) {
  make(config_with_axis());
  boot();
  for (std::uint64_t tag = 1; tag <= 80; ++tag) {
    line_->execute({.tag = tag, .request = SdoRead{.node = 5, .address = {0x2000, 0}}}, now_);
  }
  Reply reply;
  unsigned busy = 0;
  while (line_->pop_reply(reply)) {
    EXPECT_EQ(reply.error, to_error(Refusal::busy));
    ++busy;
  }
  EXPECT_GT(busy, 0U);
  EXPECT_LT(busy, 80U);
  line_->stop(now_);
  unsigned cancelled = 0;
  while (line_->pop_reply(reply)) {
    EXPECT_EQ(reply.error, to_error(Refusal::cancelled));
    ++cancelled;
  }
  EXPECT_EQ(busy + cancelled, 80U);
}

TEST_F(LineTest, EmcyIsSentOrSaysThatItIsInhibited) {
  make(config_with_axis());
  boot();
  sent();
  Command emcy{
      .tag = 1,
      .request = EmcySend{
          .code = 0x5000, .error_register = 0x01, .manufacturer = {std::byte{1}, std::byte{2}}}};
  line_->execute(emcy, now_);
  EXPECT_TRUE(answer().ok());
  EXPECT_THAT(sent(), ElementsAre("0FF#0050010102000000"));
  line_->dictionary().set({0x1015, 0}, std::uint16_t{1000});
  bool inhibited = false;
  for (unsigned i = 0; i < 40; ++i) {
    line_->execute(emcy, now_);
    inhibited = inhibited || answer().error == to_error(Refusal::inhibited);
  }
  EXPECT_TRUE(inhibited);
}

// The malformed frames of a faulty device must not displace other events.
TEST_F(LineTest, AFloodOfMalformedFramesIsCountedAndToldOnceASecond) {
  make(config_with_axis());
  boot();
  events();
  for (int i = 0; i < 3000; ++i) {
    hear(0x705, {0x05, 0x05});
    hear(0x085, {0x01});
    hear(0x585, {0x01});
    pass(milliseconds(1));
  }
  using Series = std::vector<std::pair<unsigned, bool>>;  // length, whether others were suppressed
  std::map<std::uint32_t, Series> told;
  for (const Event& event : events()) {
    if (const auto* const frame = event.get<event::MalformedFrame>()) {
      told[frame->identifier].emplace_back(frame->length, frame->suppressed != 0);
    }
  }
  EXPECT_EQ(told[0x705], (Series{{2, false}, {2, true}, {2, true}, {2, true}}));
  EXPECT_EQ(told[0x085], (Series{{1, false}, {1, true}, {1, true}, {1, true}}));
  EXPECT_EQ(told[0x585], (Series{{1, false}, {1, true}, {1, true}, {1, true}}));
  pass(seconds(9));
  EXPECT_FALSE(emitted(EventKind::malformed_frame, 5)) << "all frames were reported";
  EXPECT_EQ(line_->state().counters.frames_malformed, 9000U);
  EXPECT_EQ(line_->state().counters.events_lost, 0U);
}

TEST_F(LineTest, AnInterfaceThatFailsInvalidatesTheImageAndRefusesTransfers) {
  make(config_with_axis());
  boot();
  hear(0x185, {1, 0, 2, 0, 0, 0});
  line_->bus_event({.kind = can::BusEvent::Kind::interface_failed, .code = 19, .time = now_});
  EXPECT_TRUE(emitted(EventKind::interface_failed));
  EXPECT_EQ(line_->state().bus, can::BusState::absent);
  EXPECT_FALSE(snapshot(Direction::inputs).is_valid(0));
  line_->execute({.tag = 1, .request = SdoRead{.node = 5, .address = {0x2000, 0}}}, now_);
  EXPECT_EQ(answer().error, to_error(Refusal::line_down));
}

TEST_F(LineTest, AStateOfTheBusAfterAFailureSaysWhatItWasBeforeIt) {
  make(config_with_axis());
  boot();
  const auto state = [this](can::BusState now) {
    line_->bus_event({.state = now, .time = now_});
    auto before = can::BusState::unknown;
    for (const Event& event : events()) {
      const auto* const change = event.get<event::BusState>();
      before = change != nullptr ? change->before : before;
    }
    return before;
  };
  line_->bus_event({.kind = can::BusEvent::Kind::interface_ready, .time = now_});
  EXPECT_EQ(state(can::BusState::error_warning), can::BusState::error_active);
  EXPECT_EQ(state(can::BusState::error_active), can::BusState::error_warning);
  line_->bus_event({.kind = can::BusEvent::Kind::interface_failed, .code = 100, .time = now_});
  EXPECT_EQ(state(can::BusState::stopped), can::BusState::error_active) << "the interface failed";
  EXPECT_EQ(line_->state().bus, can::BusState::stopped);
  EXPECT_EQ(state(can::BusState::error_active), can::BusState::stopped);
}

TEST_F(LineTest, WhatAFailedNodeSentIsNotCommittedByTheNextSync) {
  LineConfig config = config_with_axis();
  for (od::ObjectDescription& object : config.nodes[0].device.objects) {
    for (od::VariableDescription& variable : object.variables) {
      if (object.index == 0x1800 && variable.sub == 2) {
        variable.value = {std::byte{1}};
      }
    }
  }
  make(std::move(config));
  boot();
  hear(0x185, {1, 0, 2, 0, 0, 0});
  hear(0x080, {});
  EXPECT_TRUE(snapshot(Direction::inputs).is_valid(0));
  hear(0x185, {3, 0, 4, 0, 0, 0});
  line_->bus_event({.kind = can::BusEvent::Kind::interface_failed, .code = 19, .time = now_});
  hear(0x080, {});
  EXPECT_FALSE(snapshot(Direction::inputs).is_valid(0));
  line_->bus_event({.kind = can::BusEvent::Kind::interface_ready, .time = now_});
  hear(0x185, {5, 0, 6, 0, 0, 0});
  hear(0x080, {});
  EXPECT_TRUE(snapshot(Direction::inputs).is_valid(0));
}

TEST_F(LineTest, ANodeWithoutHeartbeatThatIsStoppedHasNoValidValues) {
  for (const nmt::Command nmt : {nmt::Command::stop, nmt::Command::enter_pre_operational}) {
    LineConfig config = config_with_axis();
    config.nodes[0].heartbeat = {};
    make(std::move(config));
    boot();
    hear(0x185, {1, 0, 2, 0, 0, 0});
    EXPECT_TRUE(snapshot(Direction::inputs).is_valid(0));
    line_->execute({.tag = 1, .request = NmtRequest{.node = 5, .command = nmt}}, now_);
    EXPECT_TRUE(answer().ok());
    EXPECT_FALSE(snapshot(Direction::inputs).is_valid(0));
  }
}

TEST_F(LineTest, ADeviceHearsThatAnotherNodeStartedAnew) {
  LineConfig config = config_with_axis();
  config.role = Role::device;
  config.node_id = 9;
  make(std::move(config));
  line_->start(now_);
  hear(0x000, {0x01, 0x00});
  hear(0x705, {0x05});
  hear(0x185, {1, 0, 2, 0, 0, 0});
  EXPECT_TRUE(snapshot(Direction::inputs).is_valid(0));
  hear(0x705, {0x00});
  EXPECT_FALSE(snapshot(Direction::inputs).is_valid(0));
}

TEST(LineMake, EverythingWrongIsToldAtOnce) {
  LineConfig config = config_with_axis();
  config.network_id = 200;
  config.nodes.push_back(config.nodes[0]);
  config.nodes.push_back(config.nodes[0]);
  config.nodes.back().id = 127;
  config.nodes.back().heartbeat = seconds(100);
  const auto made = Line::make(std::move(config));
  EXPECT_FALSE(made.ok());
  std::string all;
  for (const Diagnostic& diagnostic : made.diagnostics) {
    all += to_string(diagnostic) + '\n';
  }
  EXPECT_THAT(all, HasSubstr("press: error: network-ID 200 is not in 1..127"));
  EXPECT_THAT(all, HasSubstr("press: error: node-ID 5 is configured twice"));
  EXPECT_THAT(all, HasSubstr("node 127 (axis) has the node-ID of the line's own node"));
  EXPECT_THAT(all, HasSubstr("node 127 (axis): heartbeat is not in 0..65535 ms"));
}

TEST(LineMake, WhatCanopenFdDoesNotHaveIsRefused) {
  LineConfig config = config_with_axis();
  config.canopen_fd = true;
  config.lss.assign = true;
  config.routing.interface = 1;
  config.routing.routes = {{.first = 3, .last = 3, .interface = 1, .gateway = 9}};
  config.connection_pool = {.first = 0x6A0, .last = 0x6DF};
  config.mpdo_scanner = {0x01'2100'02};
  config.own_values = {{{0x1F80, 0}, {std::byte{4}, std::byte{0}, std::byte{0}, std::byte{0}}}};
  config.nodes[0].heartbeat = {};
  config.nodes[0].heartbeat_consumer = {};
  config.nodes[0].guard_time = milliseconds(100);
  config.nodes[0].life_time_factor = 3;
  const auto made = Line::make(std::move(config));
  EXPECT_FALSE(made.ok());
  std::string all;
  for (const Diagnostic& diagnostic : made.diagnostics) {
    all += to_string(diagnostic) + '\n';
  }
  EXPECT_THAT(all, HasSubstr("remote USDO is not defined"));
  EXPECT_THAT(all, HasSubstr("LSS is not defined for CANopen FD"));
  EXPECT_THAT(all, HasSubstr("SDO connections are not defined for CANopen FD"));
  EXPECT_THAT(all, HasSubstr("MPDO is not defined for CANopen FD"));
  EXPECT_THAT(all, HasSubstr("1F80h bit 0 is 0: a line of CANopen FD keeps its role"));
  EXPECT_THAT(all, HasSubstr("(axis): CANopen FD has no node guarding"));
}

TEST(LineMake, EmcysOfCanopenFdNeedALineOfCanopenFd) {
  LineConfig config = config_with_axis();
  config.emcy_fd = true;
  const auto made = Line::make(std::move(config));
  ASSERT_FALSE(made.ok());
  EXPECT_THAT(to_string(made.diagnostics.at(0)), HasSubstr("emcy_fd is for lines of CANopen FD"));
}

TEST(LineMake, PdosOfCanopenFdMapWholeBytesAndHaveNoRemoteFrames) {
  LineConfig config = config_with_axis();
  od::DeviceDescription& device = config.nodes[0].device;
  device.objects.clear();
  const auto add = [&device](std::uint16_t index, std::vector<od::VariableDescription> variables) {
    device.objects.push_back({.index = index, .variables = std::move(variables)});
  };
  const auto number = [](std::uint8_t sub, od::DataType type, std::uint32_t value) {
    od::VariableDescription out{.sub = sub, .type = type};
    out.value.resize(od::byte_size(type));
    store_le(std::span(out.value), std::uint64_t{value});
    return out;
  };
  add(0x1800, {number(0, od::DataType::unsigned8, 2), number(1, od::DataType::unsigned32, 0x185),
               number(2, od::DataType::unsigned8, 253)});
  add(0x1A00,
      {number(0, od::DataType::unsigned8, 1), number(1, od::DataType::unsigned32, 0x2000'0001)});
  add(0x2000, {number(0, od::DataType::boolean, 0)});
  device.objects.back().variables[0].mappable = true;
  EXPECT_TRUE(Line::make(config).ok());
  config.canopen_fd = true;
  const auto made = Line::make(std::move(config));
  EXPECT_FALSE(made.ok());
  std::string all;
  for (const Diagnostic& diagnostic : made.diagnostics) {
    all += to_string(diagnostic) + '\n';
  }
  EXPECT_THAT(all, HasSubstr("TPDO 1 of axis has transmission type 253, which CANopen FD lacks"));
  EXPECT_THAT(all, HasSubstr("maps 2000:00 with 1 bits: CANopen FD maps whole bytes"));
}

TEST_F(LineTest, AnOutputOfMoreThan8BytesBecomesZeroAsAWhole) {
  LineConfig config = config_with_axis();
  const auto number = [](std::uint8_t sub, od::DataType type, std::uint32_t value) {
    od::VariableDescription out{.sub = sub, .type = type};
    out.value.resize(od::byte_size(type));
    store_le(std::span(out.value), std::uint64_t{value});
    return out;
  };
  od::VariableDescription text{.sub = 0, .type = od::DataType::visible_string};
  text.access = od::Access::rww;
  text.mappable = true;
  text.value.resize(16);
  using enum od::DataType;
  config.nodes[0].device.objects = {
      {.index = 0x1400,
       .variables = {number(0, unsigned8, 2), number(1, unsigned32, 0x205),
                     number(2, unsigned8, 255)}},
      {.index = 0x1600, .variables = {number(0, unsigned8, 1), number(1, unsigned32, 0x2000'0080)}},
      {.index = 0x2000, .variables = {text}}};
  config.nodes[0].heartbeat = {};
  config.canopen_fd = true;
  make(config);
  line_->start(now_);
  image::Snapshot outputs;
  const auto area = [&] {
    line_->snapshot(Direction::outputs, outputs, now_, false);
    return std::vector<std::byte>(outputs.bytes.begin(), outputs.bytes.begin() + 16);
  };
  const std::vector<std::byte> written(16, std::byte{0x11});
  OutputWrite write;
  write.layout_id = line_->layout(Direction::outputs).id;
  write.watchdog = milliseconds(100);
  write.reactions = kZeroOutputs;
  write.bytes = {{.offset = 0, .data = written}};
  ASSERT_EQ(line_->write_outputs(write, now_), OutputRefusal::none);
  EXPECT_EQ(area(), written);
  pass(milliseconds(200));
  EXPECT_EQ(area(), std::vector<std::byte>(16));
}

TEST(LineMake, OutputGroupsAreChecked) {
  LineConfig config = config_with_axis();
  config.groups = {{.number = 1, .name = "a", .entries = {0, 1}},
                   {.number = 1, .name = "b", .entries = {1, 7}}};
  config.defaults = {{.entry = 9, .value = 0}};
  const auto made = Line::make(std::move(config));
  EXPECT_FALSE(made.ok());
  EXPECT_EQ(made.diagnostics.size(), 4U);
}

TEST(LineMake, TheLayoutIdIsTheSameForTheSameDevices) {
  const auto a = Line::make(config_with_axis());
  const auto b = Line::make(config_with_axis());
  EXPECT_EQ((*a.value)->layout(Direction::inputs).id, (*b.value)->layout(Direction::inputs).id);
  EXPECT_NE((*a.value)->layout(Direction::inputs).id, (*a.value)->layout(Direction::outputs).id);
}

class SlowMedium final : public storage::Medium {
 public:
  bool read(std::vector<std::byte>& image) override {
    image = kept;
    return true;
  }
  bool keep(std::span<const std::byte> image) override {
    kept.assign(image.begin(), image.end());
    return true;
  }
  bool slow() const override { return true; }

  std::vector<std::byte> kept;
};

TEST_F(LineTest, TheOwnNodeStoresItsParameters) {
  SlowMedium medium;
  LineConfig config = config_with_axis();
  config.stores_parameters = true;
  const auto write = [this](std::uint16_t index, std::uint8_t sub, std::vector<std::byte> data) {
    line_->execute(
        {.tag = 7,
         .request = SdoWrite{.node = 127, .address = {index, sub}, .data = std::move(data)}},
        now_);
  };
  const std::vector<std::byte> save = {std::byte{'s'}, std::byte{'a'}, std::byte{'v'},
                                       std::byte{'e'}};
  make(config);
  line_->set_medium(&medium);
  line_->start(now_);
  write(0x1015, 0, {std::byte{9}, std::byte{0}});
  EXPECT_EQ(answer().error, Error{});
  write(0x1010, 1, save);
  pass(seconds(1));
  Reply reply;
  EXPECT_FALSE(line_->pop_reply(reply)) << "not stored yet";
  line_->medium_done(true);
  line_->advance(now_);
  EXPECT_EQ(answer().error, Error{});
  write(0x1010, 1, save);
  line_->medium_done(false);
  line_->advance(now_);
  EXPECT_EQ(answer().error, to_error(AbortCode::hardware));
  write(0x1010, 1, save);
  line_->stop(now_);
  EXPECT_EQ(answer().error, to_error(Refusal::cancelled));

  make(config);
  line_->set_medium(&medium);
  line_->start(now_);
  EXPECT_EQ(line_->dictionary().number({0x1015, 0}), 9U);
}

}  // namespace
}  // namespace linegate::line
