// SPDX-License-Identifier: Apache-2.0
// The values that the gateway of dds_peer publishes, so that every subscriber can compare them
// field by field. tests/interop/known_values.c has the same values in C.
#pragma once

#include <cstdint>
#include <string>

#include "bridges/dds/publisher.h"

namespace linegate::known {

inline constexpr const char* kGateway = "known-gateway";
inline constexpr const char* kLine = "line1";
inline constexpr std::uint64_t kIncarnation = 0x0123'4567'89AB'CDEF;
inline constexpr std::uint32_t kEntries = 300;  // the layout is sent in two parts
inline constexpr std::uint64_t kEvents = 1'500;
inline constexpr std::int64_t kUtc = 1'700'000'000'000'000'000;  // UTC at Instant 0, in ns

inline Instant at(std::int64_t ns) {
  return Instant{Duration{ns}};
}

inline dds::ClockMap clock() {
  return {Duration{kUtc}, dds::ClockQuality::synchronised};
}

inline dds::LineInfo line_info() {
  return {kLine, "virtual:known", 500'000, dds::Access::all};
}

inline line::LineState line_state() {
  line::LineState state;
  state.role = line::Role::device;
  state.node_id = 100;
  state.network_id = 7;
  state.own_state = nmt::State::pre_operational;
  state.manager = line::ManagerState::stopped;
  state.bus = can::BusState::error_passive;
  state.transmit_errors = 130;
  state.receive_errors = 5;
  state.load_permille = 421;
  state.nodes_configured = 3;
  state.nodes_operational = 2;
  state.flying_master = nmt::FlyingMasterState::slave;
  state.active_master = 9;
  state.master_priority = 1;
  std::uint64_t* counter = &state.counters.frames_received;
  for (std::uint64_t i = 0; i < sizeof(line::Counters) / sizeof(std::uint64_t); ++i) {
    counter[i] = 1'000 + i;
  }
  return state;
}

inline std::vector<dds::Property> properties() {
  return {{"first", "1"}, {"second", "zwei"}};
}

// As many as the contract has room for.
inline std::vector<dds::Property> all_properties() {
  std::vector<dds::Property> out = properties();
  out.resize(dds::kMaxProperties - 1, {"another", "0"});
  out.push_back({"last", "128"});
  return out;
}

inline dds::GatewayInfo gateway_info() {
  return {.version = "1.2.3",
          .started = at(7),
          .configuration = 0xFEED'F00D'0123'4567,
          .configured = at(8),
          .reloads = 9,
          .reloads_refused = 10,
          .events = 11,
          .event_stream = 0xFACE'0000'0000'0001,
          .participants = 12,
          .participants_most = 13,
          .lines = {{kLine, "virtual:known"}},
          .counters = {{"first", 14}, {"second", 0xFFFF'FFFF'FFFF'FFFF}}};
}

inline dds::NodeInfo node_info() {
  return {"drive1", at(5)};
}

inline line::NodeState node_state() {
  line::NodeState state;
  state.node = 42;
  state.configured = true;
  state.state = nmt::State::operational;
  state.presence = line::Presence::missing;
  state.heartbeat_monitored = true;
  state.boot = 'K';
  state.device_type = 0x0002'0192;
  state.vendor = 0x11;
  state.product = 0x22;
  state.revision = 0x33;
  state.serial = 0x44;
  state.error_register = 0x81;
  state.last_emcy = 0x8130;
  state.emcy_count = 6;
  state.heartbeats_lost = 2;
  state.last_heard = at(6);
  state.cause = line::StateCause::itself;
  state.spontaneous_changes = 3;
  return state;
}

inline line::OutputState output_state() {
  line::OutputState state;
  state.group = 3;
  state.name = "left";
  state.owner = "hmi";
  state.applied = 77;
  state.refused = 2;
  state.applied_at = at(7);
  state.refused_at = at(8);
  state.refusal = line::OutputRefusal::not_armed;
  state.refused_client = "old";
  state.arming = 9;
  state.arming_wanted = true;
  state.watchdog = std::chrono::milliseconds(100);
  state.deadline = at(4) + std::chrono::milliseconds(40);
  state.waiting = 5;
  state.waits = {{12, line::OutputWait::node}, {13, line::OutputWait::values}};
  return state;
}

// 300 UNSIGNED16, four in each PDO, of nodes 1, 2, ...
inline image::Layout layout() {
  image::Layout layout;
  layout.direction = image::Direction::inputs;
  layout.id = 0xFEDC'BA98'7654'3210;
  layout.byte_size = kEntries * 2;
  for (std::uint32_t i = 0; i < kEntries; ++i) {
    image::Entry entry;
    entry.bit_offset = i * 16;
    entry.bit_length = 16;
    entry.type = od::DataType::unsigned16;
    entry.node = static_cast<std::uint8_t>(1 + i / 4);
    entry.index = static_cast<std::uint16_t>(0x6401);
    entry.sub = static_cast<std::uint8_t>(1 + i % 4);
    entry.remote_pdo = 2;
    entry.local_pdo = static_cast<std::uint16_t>(1 + i / 4);
    entry.variable_index = 0xA580;
    entry.variable_sub = static_cast<std::uint8_t>(1 + i % 254);
    entry.profile = 401;
    entry.product_code = 0x1234'5678;
    entry.name = "node" + std::to_string(i / 4) + ".Input " + std::to_string(i % 4);
    entry.scaling = {.unit = "bar", .scale = 0.25, .offset = -static_cast<double>(i)};
    entry.low = -1.5;
    entry.high = i % 2 == 0 ? std::optional(99.5) : std::nullopt;
    entry.initial = i % 3 == 0 ? std::optional(2.5) : std::nullopt;
    entry.access = od::Access::rwr;
    entry.transmission_type = 254;
    entry.inhibit = std::chrono::microseconds(100);
    entry.event_timer = std::chrono::milliseconds(50);
    entry.group = i % 4 == 0 ? std::optional<std::uint16_t>() : std::optional<std::uint16_t>(7);
    layout.entries.push_back(entry);
  }
  return layout;
}

inline image::Snapshot snapshot() {
  image::Snapshot snapshot;
  snapshot.direction = image::Direction::inputs;
  snapshot.layout_id = layout().id;
  snapshot.sequence = 17;
  snapshot.acquired = at(1'000);
  snapshot.sync_count = 99;
  for (std::uint32_t i = 0; i < kEntries * 2; ++i) {
    snapshot.bytes.push_back(static_cast<std::byte>(i * 7));
  }
  snapshot.changed.assign((kEntries + 63) / 64, 0);
  snapshot.valid.assign((kEntries + 63) / 64, 0);
  snapshot.changed[0] = 0xF0;
  snapshot.valid[1] = 0x8000'0000'0000'0001;
  image::PdoMark mark;
  mark.local_pdo = 2;
  mark.remote_pdo = 2;
  mark.node = 2;
  mark.count = 3;
  mark.time = at(900);
  mark.first_entry = 4;
  mark.entries = 4;
  snapshot.marks.push_back(mark);
  return snapshot;
}

// The reception of the PDO that the snapshot has a mark of, with the same values.
inline pdo::Reception reception() {
  const image::Snapshot of = snapshot();
  const image::PdoMark& mark = of.marks[0];
  pdo::Reception out;
  out.layout_id = of.layout_id;
  out.time = mark.time;
  out.first_entry = mark.first_entry;
  out.entries = static_cast<std::uint16_t>(mark.entries);
  out.local_pdo = mark.local_pdo;
  out.remote_pdo = mark.remote_pdo;
  out.node = mark.node;
  out.lost = 17;
  std::copy_n(of.bytes.begin() + 8, 8, out.values.begin());
  return out;
}

inline Event event(std::uint64_t number) {
  event::Emcy emcy{.code = 0x8130, .error_register = 0x11};
  for (std::size_t i = 0; i < emcy.manufacturer.size(); ++i)
    emcy.manufacturer[i] = static_cast<std::byte>(i + 1);
  return {
      .number = number, .time = at(static_cast<std::int64_t>(number)), .node = 42, .data = emcy};
}

inline std::string event_text(std::uint64_t number) {
  return "node 42: EMCY 8130h, number " + std::to_string(number);
}

// Data of commands: byte i is i * 3 + seed.
inline std::vector<std::byte> pattern(std::size_t size, std::uint8_t seed) {
  std::vector<std::byte> data(size);
  for (std::size_t i = 0; i < size; ++i)
    data[i] = static_cast<std::byte>(i * 3 + seed);
  return data;
}

}  // namespace linegate::known
