// SPDX-License-Identifier: Apache-2.0
// Every member survives serialization and deserialization, with values that differ from its
// defaults.
#include <gtest/gtest.h>

#include "bridges/dds/event_codec.h"
#include "bridges/dds/event_samples.h"
#include "bridges/dds/image_samples.h"
#include "bridges/dds/output_samples.h"
#include "bridges/dds/output_state_samples.h"
#include "bridges/dds/state_samples.h"

#include "tests/dds/known_values.h"

namespace linegate::dds {
namespace {

TEST(StateSamples, LineStateComesBack) {
  const line::LineState sent = known::line_state();
  v1::LineState wire;
  to_wire(known::line_info(), sent, wire);
  LineInfo info;
  line::LineState state;
  from_wire(wire, info, state);
  EXPECT_EQ(state.role, sent.role);
  EXPECT_EQ(state.node_id, sent.node_id);
  EXPECT_EQ(state.network_id, sent.network_id);
  EXPECT_EQ(state.own_state, sent.own_state);
  EXPECT_EQ(state.manager, sent.manager);
  EXPECT_EQ(state.bus, sent.bus);
  EXPECT_EQ(state.transmit_errors, sent.transmit_errors);
  EXPECT_EQ(state.receive_errors, sent.receive_errors);
  EXPECT_EQ(state.load_permille, sent.load_permille);
  EXPECT_EQ(state.nodes_configured, sent.nodes_configured);
  EXPECT_EQ(state.nodes_operational, sent.nodes_operational);
  EXPECT_EQ(state.flying_master, sent.flying_master);
  EXPECT_EQ(state.active_master, sent.active_master);
  EXPECT_EQ(state.master_priority, sent.master_priority);
  EXPECT_EQ(std::memcmp(&state.counters, &sent.counters, sizeof state.counters), 0);
  EXPECT_EQ(info.interface_uri, "virtual:known");
  EXPECT_EQ(info.bit_rate, 500'000U);
  EXPECT_EQ(info.access, Access::all);
}

TEST(StateSamples, GatewayStateComesBackWithTimesInUtc) {
  const GatewayInfo sent = known::gateway_info();
  v1::GatewayState wire;
  to_wire(sent, known::clock(), wire);
  EXPECT_EQ(wire.started(), known::kUtc + 7);
  EXPECT_EQ(wire.configured(), known::kUtc + 8);
  GatewayInfo info;
  from_wire(wire, known::clock(), info);
  EXPECT_EQ(info.version, "1.2.3");
  EXPECT_EQ(info.started, sent.started);
  EXPECT_EQ(info.configuration, sent.configuration);
  EXPECT_EQ(info.configured, sent.configured);
  EXPECT_EQ(info.reloads, 9U);
  EXPECT_EQ(info.reloads_refused, 10U);
  EXPECT_EQ(info.events, 11U);
  EXPECT_EQ(info.event_stream, 0xFACE'0000'0000'0001U);
  EXPECT_EQ(info.participants, 12U);
  EXPECT_EQ(info.participants_most, 13U);
  ASSERT_EQ(info.lines.size(), 1U);
  EXPECT_EQ(info.lines[0].name, known::kLine);
  EXPECT_EQ(info.lines[0].interface_uri, "virtual:known");
  ASSERT_EQ(info.counters.size(), 2U);
  EXPECT_EQ(info.counters[1].name, "second");
  EXPECT_EQ(info.counters[1].value, 0xFFFF'FFFF'FFFF'FFFFU);
}

// Of a later gateway, for CANopen FD.
TEST(EventSamples, TheDataOfAnEventHaveRoomForAnFdFrame) {
  v1::Event wire;
  wire.kind(250);
  for (int i = 0; i < 64; ++i)
    wire.data().push_back(static_cast<std::uint8_t>(i));
  ReceivedEvent event;
  from_wire(wire, {}, event);
  ASSERT_EQ(event.fields.bytes().size(), 64U);
  EXPECT_EQ(event.fields.bytes()[63], std::byte{63});
  EXPECT_FALSE(event.data.has_value());
}

// Earlier gateways have no event-stream.
TEST(StateSamples, TheEventStreamIsTheLastCounterOfAGatewayState) {
  GatewayInfo sent = known::gateway_info();
  sent.counters.resize(kMaxCounters - 1, {"more", 1});
  v1::GatewayState wire;
  to_wire(sent, known::clock(), wire);
  ASSERT_EQ(wire.counters().size(), kMaxCounters);
  EXPECT_EQ(wire.counters().back().name().to_string(), "event-stream");
  GatewayInfo info;
  from_wire(wire, known::clock(), info);
  EXPECT_EQ(info.event_stream, sent.event_stream);
  EXPECT_EQ(info.counters.size(), kMaxCounters - 1);
  wire.counters().pop_back();
  from_wire(wire, known::clock(), info);
  EXPECT_EQ(info.event_stream, 0U);
  EXPECT_EQ(info.counters.size(), kMaxCounters - 1);
}

TEST(StateSamples, CountersThatTheContractHasNoRoomForAreCounted) {
  GatewayInfo sent = known::gateway_info();
  sent.counters.assign(kMaxCounters, {"more", 1});
  v1::GatewayState wire;
  to_wire(sent, known::clock(), wire);
  ASSERT_EQ(wire.counters().size(), kMaxCounters);
  EXPECT_EQ(wire.counters()[kMaxCounters - 3].name().to_string(), "more");
  EXPECT_EQ(wire.counters()[kMaxCounters - 2].name().to_string(), "counters-left-out");
  EXPECT_EQ(wire.counters()[kMaxCounters - 2].value(), 2U);
  EXPECT_EQ(wire.counters().back().name().to_string(), "event-stream");
}

// config::load() refuses a plant with more lines.
TEST(StateSamples, AllLinesOfAGatewayHaveRoom) {
  GatewayInfo sent = known::gateway_info();
  sent.lines.assign(kMaxGatewayLines, {"line", "virtual:line"});
  v1::GatewayState wire;
  to_wire(sent, known::clock(), wire);
  EXPECT_EQ(wire.lines().size(), kMaxGatewayLines);
  sent.lines.emplace_back();
  EXPECT_DEATH(to_wire(sent, known::clock(), wire), "");
}

TEST(StateSamples, TextsThatAreTooLongEndWithDots) {
  const std::string value(256, 'v');
  std::vector<v1::Property> properties;
  to_wire(std::vector<Property>{{"whole", value}, {std::string(65, 'n'), value + 'v'}}, properties);
  EXPECT_EQ(properties[0].value().to_string(), value);
  EXPECT_EQ(properties[1].name().to_string(), std::string(61, 'n') + "...");
  EXPECT_EQ(properties[1].value().to_string(), std::string(253, 'v') + "...");

  LineInfo line = known::line_info();
  line.interface_uri = "replay:" + std::string(122, 'p');
  v1::LineState line_state;
  to_wire(line, known::line_state(), line_state);
  EXPECT_EQ(line_state.interface_uri().to_string(), "replay:" + std::string(118, 'p') + "...");

  GatewayInfo gateway = known::gateway_info();
  gateway.lines[0].interface_uri = line.interface_uri;
  v1::GatewayState gateway_state;
  to_wire(gateway, known::clock(), gateway_state);
  EXPECT_TRUE(gateway_state.lines()[0].interface_uri().to_string().ends_with("p..."));

  line::OutputState outputs = known::output_state();
  outputs.owner = std::string(65, 'o');
  v1::OutputState output_state;
  to_wire(outputs, known::clock(), known::at(4), output_state);
  EXPECT_EQ(output_state.owner().to_string(), std::string(61, 'o') + "...");
}

// The longest words of a boot result that the stack has.
TEST(StateSamples, ABootTextThatIsTooLongEndsWithDots) {
  line::NodeState node = known::node_state();
  node.boot = 'J';
  node.finding = {.kind = manager::BootFinding::Kind::abort,
                  .object = {0x1F50, 1},
                  .abort = AbortCode::local_control,
                  .expected = 4'000'000'000};
  const std::string whole = manager::describe_boot(node.boot, node.finding);
  v1::NodeState wire;
  to_wire(known::node_info(), node, known::clock(), wire);
  const std::string text = wire.boot_text().to_string();
  EXPECT_TRUE(text == whole || (text.size() == 128 && text.ends_with("..."))) << text;
}

// 64 entries have room; waiting_count is the number of all.
TEST(StateSamples, WaitingEntriesThatHaveNoRoomAreCounted) {
  line::OutputState sent = known::output_state();
  sent.waits.assign(line::OutputState::kMostWaits, {7, line::OutputWait::node});
  sent.waiting = 1000;
  v1::OutputState wire;
  to_wire(sent, known::clock(), known::at(4), wire);
  EXPECT_EQ(wire.waiting().size(), 64U);
  EXPECT_EQ(wire.waiting_count(), 1000U);
}

TEST(StateSamples, NodeStateComesBackWithTimesInUtc) {
  const line::NodeState sent = known::node_state();
  v1::NodeState wire;
  to_wire(known::node_info(), sent, known::clock(), wire);
  EXPECT_EQ(wire.last_heard(), known::kUtc + 6);
  EXPECT_EQ(wire.since(), known::kUtc + 5);
  EXPECT_EQ(wire.boot_text().to_string(), std::string(line::describe_boot('K')));
  NodeInfo info;
  line::NodeState state;
  from_wire(wire, known::clock(), info, state);
  EXPECT_EQ(info.name, "drive1");
  EXPECT_EQ(info.since, known::at(5));
  EXPECT_EQ(state.node, 42);
  EXPECT_TRUE(state.configured);
  EXPECT_EQ(state.state, sent.state);
  EXPECT_EQ(state.presence, sent.presence);
  EXPECT_TRUE(state.heartbeat_monitored);
  EXPECT_EQ(state.boot, 'K');
  EXPECT_EQ(state.device_type, sent.device_type);
  EXPECT_EQ(state.vendor, sent.vendor);
  EXPECT_EQ(state.product, sent.product);
  EXPECT_EQ(state.revision, sent.revision);
  EXPECT_EQ(state.serial, sent.serial);
  EXPECT_EQ(state.error_register, sent.error_register);
  EXPECT_EQ(state.last_emcy, sent.last_emcy);
  EXPECT_EQ(state.emcy_count, sent.emcy_count);
  EXPECT_EQ(state.heartbeats_lost, sent.heartbeats_lost);
  EXPECT_EQ(state.last_heard, sent.last_heard);
  EXPECT_EQ(state.cause, sent.cause);
  EXPECT_EQ(state.spontaneous_changes, sent.spontaneous_changes);
}

TEST(StateSamples, OutputStateComesBack) {
  const line::OutputState sent = known::output_state();
  v1::OutputState wire;
  to_wire(sent, known::clock(), known::at(4), wire);
  wire.time(known::kUtc + 4);
  EXPECT_EQ(wire.watchdog_left_ns(), 40'000'000);
  line::OutputState state;
  from_wire(wire, known::clock(), state);
  EXPECT_EQ(state.group, 3);
  EXPECT_EQ(state.name, sent.name);
  EXPECT_EQ(state.owner, sent.owner);
  EXPECT_EQ(state.applied, sent.applied);
  EXPECT_EQ(state.refused, sent.refused);
  EXPECT_EQ(state.applied_at, sent.applied_at);
  EXPECT_EQ(state.refused_at, sent.refused_at);
  EXPECT_EQ(state.refusal, sent.refusal);
  EXPECT_EQ(state.refused_client, sent.refused_client);
  EXPECT_EQ(state.arming, sent.arming);
  EXPECT_TRUE(state.arming_wanted);
  EXPECT_EQ(state.watchdog, sent.watchdog);
  EXPECT_EQ(state.deadline, sent.deadline);
  EXPECT_EQ(state.waiting, sent.waiting);
  EXPECT_EQ(state.waits, sent.waits);
}

TEST(StateSamples, NeverStaysNever) {
  v1::NodeState wire;
  to_wire({}, {}, known::clock(), wire);
  EXPECT_EQ(wire.last_heard(), 0);
  EXPECT_EQ(known::clock().instant(0), Instant{});
}

TEST(StateSamples, PropertiesThatTheContractHasNoRoomForAreCounted) {
  std::vector<v1::Property> wire;
  std::vector<Property> back;
  to_wire(std::vector<Property>(128, Property{"n", "v"}), wire);
  from_wire(wire, back);
  ASSERT_EQ(back.size(), 128U);
  EXPECT_EQ(back.back().name, "n") << "all have room";
  to_wire(std::vector<Property>(129, Property{"n", "v"}), wire);
  from_wire(wire, back);
  ASSERT_EQ(back.size(), 128U);
  EXPECT_EQ(back[126].name, "n");
  EXPECT_EQ(back[127].name, "properties-left-out");
  EXPECT_EQ(back[127].value, "2");
}

TEST(ImageSamples, SnapshotComesBack) {
  const image::Snapshot sent = known::snapshot();
  v1::ProcessImage wire;
  ASSERT_TRUE(to_wire(sent, known::clock(), wire));
  EXPECT_EQ(wire.time(), known::kUtc + 1'000);
  image::Snapshot snapshot;
  ASSERT_TRUE(from_wire(wire, known::clock(), snapshot));
  EXPECT_EQ(snapshot.direction, sent.direction);
  EXPECT_EQ(snapshot.layout_id, sent.layout_id);
  EXPECT_EQ(snapshot.sequence, sent.sequence);
  EXPECT_EQ(snapshot.acquired, sent.acquired);
  EXPECT_EQ(snapshot.sync_count, sent.sync_count);
  EXPECT_EQ(snapshot.bytes, sent.bytes);
  EXPECT_EQ(snapshot.changed, sent.changed);
  EXPECT_EQ(snapshot.valid, sent.valid);
  EXPECT_EQ(snapshot.known, std::vector<std::uint64_t>(sent.valid.size()))
      << "inputs have no bits of known entries";
  ASSERT_EQ(snapshot.marks.size(), 1U);
  EXPECT_EQ(snapshot.marks[0].local_pdo, 2);
  EXPECT_EQ(snapshot.marks[0].remote_pdo, 2);
  EXPECT_EQ(snapshot.marks[0].node, 2);
  EXPECT_EQ(snapshot.marks[0].count, 3U);
  EXPECT_EQ(snapshot.marks[0].time, known::at(900));
  EXPECT_EQ(snapshot.marks[0].first_entry, 4U);
  EXPECT_EQ(snapshot.marks[0].entries, 4U);
}

TEST(ImageSamples, OutputsSayWhichEntriesAreKnown) {
  image::Snapshot sent = known::snapshot();
  sent.direction = image::Direction::outputs;
  sent.known.assign(sent.valid.size(), 0x0F0F);
  v1::ProcessImage wire;
  ASSERT_TRUE(to_wire(sent, known::clock(), wire));
  image::Snapshot snapshot;
  ASSERT_TRUE(from_wire(wire, known::clock(), snapshot));
  EXPECT_EQ(snapshot.known, sent.known);
  wire.known().pop_back();
  EXPECT_FALSE(from_wire(wire, known::clock(), snapshot));
}

TEST(ImageSamples, BitsOfTheContractCountFromTheLowEndOfEachOctet) {
  v1::ProcessImage wire;
  ASSERT_TRUE(to_wire(known::snapshot(), known::clock(), wire));
  EXPECT_EQ(wire.changed()[0], 0xF0);
  EXPECT_EQ(wire.valid()[8], 0x01);   // entry 64
  EXPECT_EQ(wire.valid()[15], 0x80);  // entry 127
}

TEST(ImageSamples, WhatIsBeyondTheBoundsIsRefused) {
  image::Snapshot large = known::snapshot();
  v1::ProcessImage wire;
  large.bytes.resize(image::kMaxAreaBytes + 1);
  EXPECT_FALSE(to_wire(large, {}, wire));
  large.bytes.resize(image::kMaxAreaBytes);
  EXPECT_TRUE(to_wire(large, {}, wire));
  wire.direction(2);
  EXPECT_FALSE(from_wire(wire, {}, large));
  wire.direction(1);
  wire.valid().pop_back();
  EXPECT_FALSE(from_wire(wire, {}, large));
}

TEST(ImageSamples, PdoUpdateHoldsTheValuesOfItsPdo) {
  const image::Snapshot snapshot = known::snapshot();
  v1::PdoUpdate wire;
  ASSERT_TRUE(to_wire(known::layout(), snapshot, snapshot.marks[0], 3, known::clock(), wire));
  PdoUpdate update;
  from_wire(wire, known::clock(), update);
  EXPECT_EQ(update.node, 2);
  EXPECT_EQ(update.pdo, 2);
  EXPECT_EQ(update.time, known::at(900));
  EXPECT_EQ(update.receptions, 3U);
  ASSERT_EQ(update.values.size(), 4U);
  EXPECT_EQ(update.values[1].entry, 5U);
  EXPECT_EQ(update.values[1].index, 0x6401);
  EXPECT_EQ(update.values[1].sub, 2);
  EXPECT_EQ(update.values[1].type, od::DataType::unsigned16);
  EXPECT_EQ(update.values[1].bit_length, 16);
  EXPECT_EQ(update.values[1].data, (std::vector{snapshot.bytes[10], snapshot.bytes[11]}));
}

TEST(ImageSamples, PdoUpdateOfAForeignLayoutIsRefused) {
  image::Snapshot snapshot = known::snapshot();
  v1::PdoUpdate wire;
  image::PdoMark mark = snapshot.marks[0];
  mark.first_entry = known::kEntries - 3;
  EXPECT_FALSE(to_wire(known::layout(), snapshot, mark, 1, {}, wire));
  snapshot.layout_id = 1;
  EXPECT_FALSE(to_wire(known::layout(), snapshot, snapshot.marks[0], 1, {}, wire));
}

TEST(ImageSamples, PdoReceptionHoldsTheValuesOfItsFrame) {
  v1::PdoReception wire;
  ASSERT_TRUE(to_wire(known::layout(), known::reception(), known::clock(), wire));
  wire.number(5);
  PdoReception reception;
  from_wire(wire, known::clock(), reception);
  EXPECT_EQ(reception.node, 2);
  EXPECT_EQ(reception.pdo, 2);
  EXPECT_EQ(reception.time, known::at(900));
  EXPECT_EQ(reception.number, 5U);
  EXPECT_EQ(reception.lost, 17U);
  const image::Snapshot snapshot = known::snapshot();
  ASSERT_EQ(reception.values.size(), 4U);
  EXPECT_EQ(reception.values[1].entry, 5U);
  EXPECT_EQ(reception.values[1].sub, 2);
  EXPECT_EQ(reception.values[1].bit_length, 16);
  EXPECT_EQ(reception.values[1].data, (std::vector{snapshot.bytes[10], snapshot.bytes[11]}));
}

TEST(ImageSamples, PdoReceptionOfAForeignLayoutIsRefused) {
  v1::PdoReception wire;
  pdo::Reception reception = known::reception();
  reception.first_entry = known::kEntries - 3;
  EXPECT_FALSE(to_wire(known::layout(), reception, {}, wire));
  reception = known::reception();
  reception.layout_id = 1;
  EXPECT_FALSE(to_wire(known::layout(), reception, {}, wire));
}

TEST(ImageSamples, BitsAreMovedToTheLowEnd) {
  const std::vector<std::byte> area{std::byte{0xA0}, std::byte{0x03}};
  std::vector<std::uint8_t> bits;
  extract_bits(area, 5, 1, bits);
  EXPECT_EQ(bits, std::vector<std::uint8_t>{1});
  extract_bits(area, 5, 5, bits);
  EXPECT_EQ(bits, std::vector<std::uint8_t>{0b11101});
  extract_bits(area, 4, 12, bits);
  EXPECT_EQ(bits, (std::vector<std::uint8_t>{0x3A, 0x00}));
}

TEST(EventSamples, EventComesBack) {
  const linegate::Event sent = known::event(9);
  v1::Event wire;
  to_wire(sent, "text", known::clock(), wire);
  EXPECT_EQ(wire.severity(), v1::SEVERITY_WARNING);
  EXPECT_EQ(wire.data().size(), 5U);
  ReceivedEvent event;
  from_wire(wire, known::clock(), event);
  EXPECT_EQ(event.number, 9U);
  EXPECT_EQ(event.time, sent.time);
  EXPECT_EQ(event.kind, sent.kind());
  EXPECT_EQ(event.severity, EventSeverity::warning);
  EXPECT_EQ(event.node, sent.node);
  EXPECT_EQ(event.fields, pack(sent.data));
  EXPECT_EQ(event.data, sent.data);
}

TEST(EventSamples, AKindOfANewerGatewayKeepsItsNumberAndItsFields) {
  v1::Event wire;
  wire.kind(kEventKinds);
  wire.code(7);
  wire.value(8);
  wire.data({9});
  ReceivedEvent event;
  from_wire(wire, known::clock(), event);
  EXPECT_EQ(static_cast<std::size_t>(event.kind), kEventKinds);
  EXPECT_EQ(event.severity, EventSeverity::error);
  EXPECT_EQ(event.fields,
            (EventFields{.code = 7, .value = 8, .length = 1, .data = {std::byte{9}}}));
  EXPECT_FALSE(event.data);
}

TEST(EventSamples, DataOfAStrangerAreCutToTheirBound) {
  v1::Event wire;
  wire.data().resize(100, 1);
  ReceivedEvent event;
  from_wire(wire, {}, event);
  EXPECT_EQ(event.fields.length, 64);
}

line::OutputWrite output() {
  line::OutputWrite write;
  write.group = 3;
  write.layout_id = 4;
  write.arming = 5;
  write.watchdog = std::chrono::milliseconds(100);
  write.reactions = line::kZeroOutputs | line::kNmtStop;
  write.values.push_back({7, 2, {std::byte{1}, std::byte{2}}});
  write.bytes.push_back({16, {std::byte{3}}});
  return write;
}

TEST(OutputSamples, OutputWriteComesBack) {
  v1::OutputWrite wire;
  ASSERT_TRUE(to_wire(output(), wire));
  line::OutputWrite write;
  ASSERT_EQ(from_wire(wire, write).refusal, line::OutputRefusal::none);
  EXPECT_EQ(write.group, 3);
  EXPECT_EQ(write.layout_id, 4U);
  EXPECT_EQ(write.arming, 5U);
  EXPECT_EQ(write.watchdog, std::chrono::milliseconds(100));
  EXPECT_EQ(write.reactions, line::kZeroOutputs | line::kNmtStop);
  ASSERT_EQ(write.values.size(), 1U);
  EXPECT_EQ(write.values[0].entry, 7U);
  EXPECT_EQ(write.values[0].length, 2);
  EXPECT_EQ(write.values[0].data[1], std::byte{2});
  ASSERT_EQ(write.bytes.size(), 1U);
  EXPECT_EQ(write.bytes[0].offset, 16U);
  EXPECT_EQ(write.bytes[0].data, std::vector{std::byte{3}});
}

// Of lines of CANopen FD.
TEST(OutputSamples, ValuesOfThirtyTwoBytesComeBack) {
  line::OutputWrite sent = output();
  sent.values[0].length = 32;
  for (std::size_t i = 0; i < 32; ++i)
    sent.values[0].data[i] = static_cast<std::byte>(i + 1);
  v1::OutputWrite wire;
  ASSERT_TRUE(to_wire(sent, wire));
  line::OutputWrite write;
  ASSERT_EQ(from_wire(wire, write).refusal, line::OutputRefusal::none);
  EXPECT_EQ(write.values[0].length, 32);
  EXPECT_EQ(write.values[0].data, sent.values[0].data);
}

TEST(OutputSamples, WhatCannotBeUnderstoodIsRefused) {
  using line::OutputRefusal;
  v1::OutputWrite good;
  ASSERT_TRUE(to_wire(output(), good));
  line::OutputWrite write;
  const auto refusal = [&](auto spoil) {
    v1::OutputWrite bad = good;
    spoil(bad);
    return from_wire(bad, write).refusal;
  };
  EXPECT_EQ(refusal([](auto& w) { w.reactions(0x80); }), OutputRefusal::bad_reaction);
  EXPECT_EQ(refusal([](auto& w) { w.reactions(0x06); }), OutputRefusal::bad_reaction);
  EXPECT_EQ(refusal([](auto& w) { w.watchdog_ns(-1); }), OutputRefusal::bad_reaction);
  EXPECT_EQ(refusal([](auto& w) { w.values()[0].data().resize(33); }), OutputRefusal::bad_length);
  EXPECT_EQ(refusal([](auto& w) { w.values()[0].data().clear(); }), OutputRefusal::bad_length);
  EXPECT_EQ(refusal([](auto& w) { w.values().resize(4'097, w.values()[0]); }),
            OutputRefusal::bad_length);
  EXPECT_EQ(refusal([](auto& w) { w.bytes()[0].offset(131'072); }), OutputRefusal::bad_length);
  EXPECT_EQ(refusal([](auto& w) { w.bytes()[0].offset(0xFFFF'FFFF); }), OutputRefusal::bad_length);
  EXPECT_EQ(refusal([](auto& w) { w.bytes()[0].data().clear(); }), OutputRefusal::bad_length);
  EXPECT_EQ(refusal([](auto& w) { w.bytes()[0].offset(131'071); }), OutputRefusal::none);
  const auto runs = [](std::size_t count) {
    return [count](auto& w) {
      w.bytes()[0].data().resize(8'192);
      w.bytes().resize(count, w.bytes()[0]);
    };
  };
  EXPECT_EQ(refusal(runs(16)), OutputRefusal::none);
  EXPECT_EQ(refusal(runs(17)), OutputRefusal::bad_length) << "longer than any output area";
}

}  // namespace
}  // namespace linegate::dds
