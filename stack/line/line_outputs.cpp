// SPDX-License-Identifier: Apache-2.0
// Output values: applied whole, and the watchdog when they stop coming.
#include <algorithm>

#include "stack/line/line_impl.h"
#include "stack/od/objects.h"

namespace linegate::line {
namespace {

using image::Direction;

// IXXAT CANopen Manager API manual 5.17: 00 62 81 00 00 00 00 00.
constexpr std::uint16_t kWatchdogEmcy = 0x6200;
constexpr std::uint8_t kWatchdogRegister = 0x81;

struct NmtReaction {
  WatchdogReaction bit;
  nmt::Command command;
};
constexpr NmtReaction kNmtReactions[] = {
    {kNmtPreOperational, nmt::Command::enter_pre_operational},
    {kNmtStop, nmt::Command::stop},
    {kNmtResetCommunication, nmt::Command::reset_communication},
    {kNmtResetNode, nmt::Command::reset_node},
};

}  // namespace

OutputRefusal Line::Impl::write_outputs(const OutputWrite& write, Instant now) {
  if (const OutputRefusal refusal = outputs.check(write); refusal != OutputRefusal::none) {
    outputs.note_refused(write.group, refusal, write.client, now);
    return refuse(write, refusal, now);
  }
  ++counters.output_writes;
  if (outputs.accept(write, now)) {
    const auto ms = std::chrono::duration_cast<std::chrono::milliseconds>(write.watchdog).count();
    emit(EventKind::output_armed, now, static_cast<std::uint32_t>(ms), write.group);
    if (!outputs.any_silent()) {
      node.end_reported(kWatchdogEmcy, now);
    }
  }
  apply(write, outputs.group(write.group)->config.send_always, now);
  return OutputRefusal::none;
}

// Precondition: the entry is not valid.
OutputWait Line::Impl::reason_of(std::uint32_t entry) const {
  const image::Entry& place = image.layout(Direction::outputs).entries[entry];
  if (!image.is_known(Direction::outputs, entry)) {
    return OutputWait::value;
  }
  if (!image.pdo_known(Direction::outputs, place.local_pdo)) {
    return OutputWait::values;
  }
  if (node.state() != nmt::State::operational) {
    return OutputWait::own_node;
  }
  if (place.local_pdo == 0) {
    return bus_is_stuck(advanced_to) ? OutputWait::bus : OutputWait::turn;
  }
  using enum pdo::Engine::Receiver;
  const pdo::Engine::Receiver state = receiver(place.node);
  if (state == waiting || state == unheard) {
    return OutputWait::node;
  }
  if (updates.waits(place.local_pdo)) {
    return OutputWait::update_time;
  }
  const pdo::Engine& pdos = node.pdos();
  if (pdos.awaits_trigger(place.local_pdo, place.bit_offset, place.bit_length)) {
    return OutputWait::trigger;
  }
  return bus_is_stuck(advanced_to) ? OutputWait::bus : OutputWait::turn;
}

void Line::Impl::output_state(std::size_t position, OutputState& out) const {
  outputs.describe(position, out);
  for (const std::uint32_t entry : outputs.groups()[position].config.entries) {
    if (image.is_valid(Direction::outputs, entry)) {
      continue;
    }
    ++out.waiting;
    if (out.waits.size() < OutputState::kMostWaits) {
      out.waits.push_back({entry, reason_of(entry)});
    }
  }
}

[[gnu::hot]] void Line::Impl::outputs_written(std::uint32_t bit_offset, std::uint32_t bits,
                                              bool always, Instant now) {
  node.pdos().outputs_written(bit_offset, bits, always, now);
  if (!scanned_outputs.empty()) {
    scanned_written(bit_offset, bits, always);
  }
}

// All bytes first, then the PDOs: a PDO never carries half of a write.
void Line::Impl::apply(const OutputWrite& write, bool always, Instant now) {
  const image::Layout& layout = image.layout(Direction::outputs);
  for (const OutputValue& value : write.values) {
    image.write_entry(Direction::outputs, value.entry, std::span(value.data).first(value.length));
  }
  for (const OutputBytes& run : write.bytes) {
    image.write_bytes(Direction::outputs, run.offset, run.data);
  }
  for (const OutputValue& value : write.values) {
    const image::Entry& entry = layout.entries[value.entry];
    outputs_written(entry.bit_offset, entry.bit_length, always, now);
  }
  for (const OutputBytes& run : write.bytes) {
    outputs_written(run.offset * 8U, static_cast<std::uint32_t>(run.data.size() * 8U), always, now);
  }
}

[[gnu::hot]] void Line::Impl::write_bound(std::span<const BoundValue> values, Instant now) {
  const image::Layout& layout = image.layout(Direction::outputs);
  bool any_forwarded = false;
  for (const BoundValue& value : values) {
    routed.values += value.always ? 1U : 0U;
    if ((value.entry & kForwarded) != 0) {
      const std::size_t object = value.entry & ~kForwarded;
      any_forwarded = true;
      node.dictionary().set(config.forwarding.objects[object].address, value.value);
    } else if (value.valid) {
      image.write_entry(Direction::outputs, value.entry, value.value);
    } else {
      image.forget_entry(Direction::outputs, value.entry);
    }
  }
  // What lies side by side is told together: mostly it is the values of one PDO, which is then
  // sampled once.
  for (std::size_t i = 0; i < values.size();) {
    const BoundValue& first = values[i++];
    if ((first.entry & kForwarded) != 0) {
      continue;
    }
    const std::uint32_t begin = layout.entries[first.entry].bit_offset;
    std::uint32_t end = begin + layout.entries[first.entry].bit_length;
    for (; i < values.size() && values[i].always == first.always &&
           (values[i].entry & kForwarded) == 0 && layout.entries[values[i].entry].bit_offset == end;
         ++i) {
      end += layout.entries[values[i].entry].bit_length;
    }
    outputs_written(begin, end - begin, first.always, now);
  }
  if (any_forwarded) {
    request_forwarded(values, now);
  }
}

// For each PDO that was received elsewhere, see Forwarding::feeds_every_tpdo.
void Line::Impl::request_forwarded(std::span<const BoundValue> values, Instant now) {
  forwarded.follow(node.dictionary(), node.pdos().revision());
  const auto of_same_pdo = [](const BoundValue& a, const BoundValue& b) {
    return (b.entry & kForwarded) != 0 && b.always && a.source == b.source;
  };
  for (std::size_t i = 0; i < values.size(); ++i) {
    const BoundValue& value = values[i];
    const auto told = [&](const BoundValue& before) { return of_same_pdo(value, before); };
    if (!of_same_pdo(value, value) || std::ranges::any_of(values.first(i), told)) {
      continue;
    }
    std::uint16_t first = 0;
    for (const BoundValue& other : values.subspan(i)) {
      if (!of_same_pdo(value, other)) {
        continue;
      }
      for (const std::uint16_t tpdo : forwarded.tpdos(other.entry & ~kForwarded)) {
        first = first == 0 ? tpdo : std::min(first, tpdo);
        if (config.forwarding.feeds_every_tpdo) {
          node.pdos().trigger(tpdo, now);
        }
      }
    }
    if (!config.forwarding.feeds_every_tpdo && first != 0) {
      node.pdos().trigger(first, now);
    }
  }
}

// The newest of the RPDOs that map it counts.
Line::Input Line::Impl::forwarded_input(std::size_t object) const {
  forwarded.follow(node.dictionary(), node.pdos().revision());
  Input out;
  out.value = node.dictionary().number(config.forwarding.objects[object].address).value_or(0);
  const image::Area& inputs = image.area(Direction::inputs);
  for (const std::uint16_t number : forwarded.rpdos(object)) {
    const Instant last = inputs.pdo(number - 1U).last;
    if (last > out.received) {
      out.valid = true;
      out.late = node.pdos().timed_out(number);
      out.received = last;
      out.pdo = number;
    }
  }
  return out;
}

// A state that was not heard but follows from a command (manager.cpp: assume_state) holds when the
// command is on the bus.
pdo::Engine::Receiver Line::Impl::receiver(std::uint8_t id) const {
  using pdo::Engine;
  const NodeState& seen = manager.node(id);
  const bool operational = seen.presence == manager::Presence::present &&
                           seen.state == nmt::State::operational && !manager.held(id) &&
                           !manager.boots(id);
  if (!manages() && seen.presence == manager::Presence::unknown) {
    return Engine::Receiver::unheard;
  }
  return running && usable() && operational && unconfirmed[id].heartbeats == 0 &&
                 !lost_starts[id] && !has_end[id] && nmt.next_wake() == kNever
             ? Engine::Receiver::started
             : Engine::Receiver::waiting;
}

void Line::Impl::note_sent(nmt::Command command, std::uint8_t id, Instant now) {
  diagnosing.diagnosis().commanded(command, id);
  manager.sent(command, id, now);
  note_command(command, id);
}

void Line::Impl::note_command(nmt::Command command, std::uint8_t id) {
  lss.commanded(command, id);
  forget_starts(id);
  for (const NodeConfig& device : config.nodes) {
    if (id != 0 && id != device.id) {
      continue;
    }
    if (command != nmt::Command::start) {
      expect_state(device.id);
    } else if (!manager.reports_state(device.id)) {
      unconfirmed[device.id] = {};
    }
    receivers_changed = true;
  }
}

// A heartbeat that says Operational may have been on its way when the command was sent.
void Line::Impl::expect_state(std::uint8_t id) {
  constexpr std::uint8_t kHeartbeats = 2;
  unconfirmed[id] = {.heartbeats = kHeartbeats};
  outputs_invalid(id);
}

// A controller that had no bus sends the heartbeats of that time at once: several within half a
// heartbeat time are one.
void Line::Impl::confirm(std::uint8_t id, nmt::State state, Instant now) {
  Unconfirmed& left = unconfirmed[id];
  if (left.heartbeats == 0) {
    return;
  }
  receivers_changed = true;
  if (state != nmt::State::operational) {
    left = {};
  } else if (left.heard == Instant{} || now - left.heard >= heartbeat_time(id) / 2) {
    --left.heartbeats;
    left.heard = now;
  }
}

// Between two heartbeats or guard answers of a node as they are configured; 0 = not known.
Duration Line::Impl::heartbeat_time(std::uint8_t id) const {
  const auto it = std::ranges::find(config.nodes, id, &NodeConfig::id);
  if (it == config.nodes.end()) {
    return {};
  }
  return it->heartbeat != Duration::zero() ? it->heartbeat : it->guard_time;
}

void Line::Impl::outputs_invalid(std::uint8_t id) {
  if (node.pdos().receiver(id) == pdo::Engine::Receiver::started) {
    node.pdos().set_receiver(id, pdo::Engine::Receiver::waiting);
  }
  receivers_changed = true;
}

void Line::Impl::follow_receivers() {
  if (!receivers_changed && receivers_seen == manager.changes()) {
    return;
  }
  receivers_seen = manager.changes();
  receivers_changed = nmt.next_wake() != kNever;
  for (const NodeConfig& device : config.nodes) {
    node.pdos().set_receiver(device.id, receiver(device.id));
  }
}

void Line::Impl::apply_defaults(Instant now) {
  const image::Layout& layout = image.layout(Direction::outputs);
  for (const OutputDefault& value : config.defaults) {
    image.write_entry(Direction::outputs, value.entry, value.value);
  }
  for (const OutputDefault& value : config.defaults) {
    const image::Entry& entry = layout.entries[value.entry];
    outputs_written(entry.bit_offset, entry.bit_length, true, now);
  }
}

// Reactions that do not belong to the role are ignored (IXXAT manual 5.17); the event tells those
// that were taken.
void Line::Impl::react(const Outputs::Group& group, Instant now) {
  std::uint8_t taken = kHoldOutputs;
  if ((group.reactions & kZeroOutputs) != 0) {
    zero(group, now);
    taken |= kZeroOutputs;
  }
  for (const NmtReaction& reaction : kNmtReactions) {
    if ((group.reactions & reaction.bit) != 0 && manages() && nmt.send(reaction.command, 0, now)) {
      note_sent(reaction.command, 0, now);
      manager.commanded(reaction.command, 0, now);
      taken |= reaction.bit;
    }
  }
  if ((group.reactions & kSendEmcy) != 0) {
    (void)node.report_error(kWatchdogEmcy, kWatchdogRegister, {}, now);
    taken |= kSendEmcy;
  }
  if ((group.reactions & kHeartbeatOff) != 0 && !manages()) {
    node.dictionary().set({od::objects::kProducerHeartbeatTime, 0}, std::uint16_t{0});
    taken |= kHeartbeatOff;
  }
  emit(EventKind::output_watchdog, now, taken, group.config.number);
}

// An entry that was never written stays so: its PDO is held back as before.
void Line::Impl::zero(const Outputs::Group& group, Instant now) {
  const image::Layout& layout = image.layout(Direction::outputs);
  for (const std::uint32_t entry : group.config.entries) {
    if (image.is_known(Direction::outputs, entry)) {
      image.write_entry(Direction::outputs, entry, std::uint64_t{0});
    }
  }
  for (const std::uint32_t entry : group.config.entries) {
    const image::Entry& place = layout.entries[entry];
    outputs_written(place.bit_offset, place.bit_length, true, now);
  }
}

}  // namespace linegate::line
