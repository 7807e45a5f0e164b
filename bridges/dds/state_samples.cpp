// SPDX-License-Identifier: Apache-2.0
#include "bridges/dds/state_samples.h"

#include <algorithm>
#include <string>
#include <type_traits>

#include "stack/base/assert.h"
#include "stack/base/short_text.h"

namespace linegate::dds {
namespace {

// A counter of GatewayState, because the members of that type are final.
constexpr const char* kEventStream = "event-stream";
// The number of counters that have no room.
constexpr const char* kCountersLeftOut = "counters-left-out";

// The members that differ only in name between the contract and the stack. One list serves both
// directions: pair(wire, stack) copies in one of them.
template <class Wire, class Stack, class Pair>
void each_counter(Wire& wire, Stack& stack, Pair pair) {
  pair(wire.frames_received(), stack.frames_received);
  pair(wire.frames_sent(), stack.frames_sent);
  pair(wire.frames_unused(), stack.frames_unused);
  pair(wire.frames_malformed(), stack.frames_malformed);
  pair(wire.frames_lost(), stack.frames_lost);
  pair(wire.bus_errors(), stack.bus_errors);
  pair(wire.rpdos(), stack.rpdos);
  pair(wire.tpdos(), stack.tpdos);
  pair(wire.tpdos_coalesced(), stack.tpdos_coalesced);
  pair(wire.syncs(), stack.syncs);
  pair(wire.emcys(), stack.emcys);
  pair(wire.heartbeats_lost(), stack.heartbeats_lost);
  pair(wire.sdo_transfers(), stack.sdo_transfers);
  pair(wire.sdo_aborts(), stack.sdo_aborts);
  pair(wire.commands(), stack.commands);
  pair(wire.commands_refused(), stack.commands_refused);
  pair(wire.output_writes(), stack.output_writes);
  pair(wire.output_writes_refused(), stack.output_writes_refused);
  pair(wire.events(), stack.events);
  pair(wire.events_lost(), stack.events_lost);
  pair(wire.receptions_lost(), stack.receptions_lost);
  pair(wire.fd_frames_received(), stack.fd_frames_received);
  pair(wire.fd_frames_sent(), stack.fd_frames_sent);
  pair(wire.usdo_transfers(), stack.usdo_transfers);
  pair(wire.usdo_aborts(), stack.usdo_aborts);
}

template <class Wire, class Stack, class Pair>
void each_member(Wire& wire, Stack& stack,
                 Pair pair) requires std::is_same_v<std::remove_const_t<Stack>, line::LineState> {
  pair(wire.role(), stack.role);
  pair(wire.node_id(), stack.node_id);
  pair(wire.network_id(), stack.network_id);
  pair(wire.own_state(), stack.own_state);
  pair(wire.manager(), stack.manager);
  pair(wire.bus(), stack.bus);
  pair(wire.transmit_errors(), stack.transmit_errors);
  pair(wire.receive_errors(), stack.receive_errors);
  pair(wire.load_permille(), stack.load_permille);
  pair(wire.nodes_configured(), stack.nodes_configured);
  pair(wire.nodes_operational(), stack.nodes_operational);
  pair(wire.flying_master(), stack.flying_master);
  pair(wire.active_master(), stack.active_master);
  pair(wire.master_priority(), stack.master_priority);
  each_counter(wire.count(), stack.counters, pair);
}

template <class Wire, class Stack, class Pair>
void each_member(Wire& wire, Stack& stack,
                 Pair pair) requires std::is_same_v<std::remove_const_t<Stack>, line::NodeState> {
  pair(wire.node(), stack.node);
  pair(wire.configured(), stack.configured);
  pair(wire.state(), stack.state);
  pair(wire.presence(), stack.presence);
  pair(wire.heartbeat_monitored(), stack.heartbeat_monitored);
  pair(wire.boot(), stack.boot);
  pair(wire.device_type(), stack.device_type);
  pair(wire.vendor(), stack.vendor);
  pair(wire.product(), stack.product);
  pair(wire.revision(), stack.revision);
  pair(wire.serial(), stack.serial);
  pair(wire.error_register(), stack.error_register);
  pair(wire.last_emcy(), stack.last_emcy);
  pair(wire.emcy_count(), stack.emcy_count);
  pair(wire.heartbeats_lost(), stack.heartbeats_lost);
  pair(wire.cause(), stack.cause);
  pair(wire.spontaneous_changes(), stack.spontaneous_changes);
}

// Lengths of texts in the contract, in bytes.
constexpr std::size_t kLongestCounterName = 64;
constexpr std::size_t kLongestBootText = 128;
constexpr std::size_t kLongestUri = 128;
constexpr std::size_t kLongestValue = 256;

void to_wire(const NamedCounter& from, v1::NamedCounter& to) {
  to.name(short_text(from.name, kLongestCounterName));
  to.value(from.value);
}

// The last one is always the event stream.
void to_wire(const std::vector<NamedCounter>& from, std::uint64_t stream,
             std::vector<v1::NamedCounter>& to) {
  constexpr std::size_t kRoom = kMaxCounters - 1;
  const bool all = from.size() <= kRoom;
  const std::size_t copied = all ? from.size() : kRoom - 1;
  to.resize(copied);
  for (std::size_t i = 0; i < copied; ++i)
    to_wire(from[i], to[i]);
  if (!all)
    to_wire({kCountersLeftOut, from.size() - copied}, to.emplace_back());
  to_wire({kEventStream, stream}, to.emplace_back());
}

constexpr auto kToWire = [](auto& wire, const auto& stack) {
  wire = static_cast<std::remove_reference_t<decltype(wire)>>(stack);
};
constexpr auto kFromWire = [](const auto& wire, auto& stack) {
  stack = static_cast<std::remove_reference_t<decltype(stack)>>(wire);
};

}  // namespace

void to_wire(const std::vector<Property>& from, std::vector<v1::Property>& to) {
  const bool all = from.size() <= kMaxProperties;
  const std::size_t copied = all ? from.size() : kMaxProperties - 1;
  to.resize(all ? copied : kMaxProperties);
  for (std::size_t i = 0; i < copied; ++i) {
    to[i].name(short_text(from[i].name, kLongestCounterName));
    to[i].value(short_text(from[i].value, kLongestValue));
  }
  if (!all) {
    to[copied].name("properties-left-out");
    to[copied].value(std::to_string(from.size() - copied));
  }
}

void from_wire(const std::vector<v1::Property>& from, std::vector<Property>& to) {
  to.clear();
  for (const v1::Property& property : from) {
    to.push_back({property.name().to_string(), property.value().to_string()});
  }
}

void to_wire(const LineInfo& info, const line::LineState& state, v1::LineState& to) {
  to.access(static_cast<std::uint8_t>(info.access));
  to.interface_uri(short_text(info.interface_uri, kLongestUri));
  to.bit_rate(info.bit_rate);
  each_member(to, state, kToWire);
}

void from_wire(const v1::LineState& from, LineInfo& info, line::LineState& state) {
  info.name = from.line().to_string();
  info.interface_uri = from.interface_uri().to_string();
  info.bit_rate = from.bit_rate();
  info.access = static_cast<Access>(from.access());
  each_member(from, state, kFromWire);
}

void to_wire(const NodeInfo& info, const line::NodeState& state, const ClockMap& clock,
             v1::NodeState& to) {
  to.name(info.name);
  to.since(clock.utc(info.since));
  to.last_heard(clock.utc(state.last_heard));
  to.boot_text(short_text(manager::describe_boot(state.boot, state.finding), kLongestBootText));
  each_member(to, state, kToWire);
}

void from_wire(const v1::NodeState& from, const ClockMap& clock, NodeInfo& info,
               line::NodeState& state) {
  info.name = from.name().to_string();
  info.since = clock.instant(from.since());
  state.last_heard = clock.instant(from.last_heard());
  each_member(from, state, kFromWire);
}

void to_wire(const GatewayInfo& info, const ClockMap& clock, v1::GatewayState& to) {
  to.version(info.version);
  to.started(clock.utc(info.started));
  to.configuration(info.configuration);
  to.configured(clock.utc(info.configured));
  to.reloads(info.reloads);
  to.reloads_refused(info.reloads_refused);
  to.events(info.events);
  to.participants(static_cast<std::uint32_t>(info.participants));
  to.participants_most(static_cast<std::uint32_t>(info.participants_most));
  LINEGATE_ASSERT(info.lines.size() <= kMaxGatewayLines,
                  "a plant with more lines is refused when it is read");
  to.lines().resize(info.lines.size());
  for (std::size_t i = 0; i < to.lines().size(); ++i) {
    to.lines()[i].name(info.lines[i].name);
    to.lines()[i].interface_uri(short_text(info.lines[i].interface_uri, kLongestUri));
  }
  to_wire(info.counters, info.event_stream, to.counters());
}

void from_wire(const v1::GatewayState& from, const ClockMap& clock, GatewayInfo& info) {
  info.version = from.version().to_string();
  info.started = clock.instant(from.started());
  info.configuration = from.configuration();
  info.configured = clock.instant(from.configured());
  info.reloads = from.reloads();
  info.reloads_refused = from.reloads_refused();
  info.events = from.events();
  info.participants = from.participants();
  info.participants_most = from.participants_most();
  info.lines.clear();
  for (const v1::GatewayLine& line : from.lines())
    info.lines.push_back({line.name().to_string(), line.interface_uri().to_string()});
  info.counters.clear();
  info.event_stream = 0;
  for (const v1::NamedCounter& counter : from.counters()) {
    if (counter.name().to_string() == kEventStream)
      info.event_stream = counter.value();
    else
      info.counters.push_back({counter.name().to_string(), counter.value()});
  }
}

}  // namespace linegate::dds
