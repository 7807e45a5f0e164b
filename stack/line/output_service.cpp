// SPDX-License-Identifier: Apache-2.0
#include "stack/line/output_service.h"

#include <algorithm>
#include <array>
#include <utility>

#include "stack/base/assert.h"
#include "stack/line/command_checks.h"
#include "stack/line/entry_bytes.h"
#include "stack/line/line.h"
#include "stack/line/mpdo_service.h"
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

// The reason in the answer for several PDOs is the one that comes first here.
constexpr std::array kWorstFirst{PdoWait::values, PdoWait::operational, PdoWait::bus,
                                 PdoWait::turn,   PdoWait::trigger,     PdoWait::update_time,
                                 PdoWait::none};
static_assert(kWorstFirst.size() == kPdoWaits);

bool is_worse(PdoWait wait, PdoWait than) {
  return std::ranges::find(kWorstFirst, wait) < std::ranges::find(kWorstFirst, than);
}

}  // namespace

std::vector<std::uint32_t> entries_of(const image::Layout& layout, std::uint8_t node,
                                      od::Address address) {
  std::vector<std::uint32_t> out;
  for (std::uint32_t i = 0; i < layout.entries.size(); ++i) {
    const image::Entry& entry = layout.entries[i];
    if (entry.node == node && od::Address{entry.index, entry.sub} == address) {
      out.push_back(i);
    }
  }
  return out;
}

OutputService::OutputService(ServiceHost& host, const LineConfig& config, const Parts& parts,
                             Service& by_sdo)
    : Service(host),
      config_(config),
      parts_(parts),
      by_sdo_(by_sdo),
      outputs_(parts.image.layout(Direction::outputs), config.groups, config.bound),
      own_(config, parts.node, parts.image, parts.flying),
      updates_(config.pdo_update_time) {
}

std::span<const CommandKind> OutputService::commands() const {
  static constexpr std::array kCommands{CommandKind::output_write, CommandKind::object_write,
                                        CommandKind::pdo_trigger};
  return kCommands;
}

void OutputService::execute(Command command, Instant now) {
  if (parts_.flying.is_passive()) {
    host().refuse(command, Refusal::wrong_role, now);
  } else if (std::holds_alternative<SingleOutput>(command.request)) {
    write_entry(std::move(command), now);
  } else if (std::holds_alternative<ObjectWrite>(command.request)) {
    write_object(std::move(command), now);
  } else {
    answer_trigger(std::move(command), now);
  }
}

void OutputService::advance(Instant now) {
  request_updated(now);
  own_.advance(now);
}

void OutputService::before_boot(Instant now) {
  host().refuse_unsent(CommandKind::pdo_trigger, Refusal::wrong_state, now);
  host().refuse_gone(
      [this](const Command& command) {
        const std::optional<std::uint32_t> own = own_entry_of(command);
        return own && own_.is_reset(*own);
      },
      Refusal::wrong_state, now);
}

// The output of the own node that the command writes.
std::optional<std::uint32_t> OutputService::own_entry_of(const Command& command) const {
  const image::Layout& layout = parts_.image.layout(Direction::outputs);
  std::vector<std::uint32_t> written;
  if (const auto* const output = std::get_if<SingleOutput>(&command.request)) {
    written = {output->entry};
  } else if (const auto* const object = std::get_if<ObjectWrite>(&command.request)) {
    written = entries_of(layout, object->node, object->address);
  }
  return written.empty() || layout.entries[written.front()].local_pdo != 0
             ? std::nullopt
             : std::optional(written.front());
}

// --- single values --------------------------------------------------------------------------

void OutputService::write_entry(Command command, Instant now) {
  const image::Layout& layout = parts_.image.layout(Direction::outputs);
  const auto& request = std::get<SingleOutput>(command.request);
  const Error why = check_single_output(request, layout, outputs_);
  if (why == to_error(Refusal::wrong_state)) {
    refuse_fired(command, request.entry, now);
    return;
  }
  if (why != Error{}) {
    host().answer(command, why, {}, now);
    return;
  }
  const image::Entry& entry = layout.entries[request.entry];
  if (!parts_.receivers.takes_single_writes(entry.node)) {
    host().refuse(command, Refusal::wrong_state, now, entry.node);
    return;
  }
  parts_.image.write_entry(Direction::outputs, request.entry, request.data);
  entry_written(request.entry, true, now);
  if (entry.local_pdo == 0) {
    const std::uint32_t own = request.entry;
    answer_own(std::move(command), own, false, now);
    return;
  }
  answer_write(std::move(command), std::span(&entry.local_pdo, 1), false, now);
}

void OutputService::write_object(Command command, Instant now) {
  const auto& request = std::get<ObjectWrite>(command.request);
  const auto places =
      entries_of(parts_.image.layout(Direction::outputs), request.node, request.address);
  if (places.empty() || request.force_sdo || parts_.settings.enforce_sdo) {
    by_sdo_.execute(std::move(command), now);
    return;
  }
  write_by_pdo(std::move(command), places, now);
}

// Writes the value into every PDO that maps the object.
void OutputService::write_by_pdo(Command command, std::span<const std::uint32_t> entries,
                                 Instant now) {
  const auto& request = std::get<ObjectWrite>(command.request);
  if (const Refusal why = check_by_pdo(request, entries); why != Refusal::none) {
    host().refuse(command, why, now);
    return;
  }
  const auto fired = std::ranges::find_if(
      entries, [this](std::uint32_t entry) { return outputs_.fired_group(entry) != nullptr; });
  if (fired != entries.end()) {
    refuse_fired(command, *fired, now);
    return;
  }
  for (const std::uint32_t entry : entries) {
    parts_.image.write_entry(Direction::outputs, entry, request.data);
  }
  const image::Layout& layout = parts_.image.layout(Direction::outputs);
  const bool keep = request.keep_pdo || parts_.settings.manual_trigger;
  if (layout.entries[entries.front()].local_pdo == 0) {
    if (!keep) {
      entry_written(entries.front(), true, now);
    }
    answer_own(std::move(command), entries.front(), keep, now);
    return;
  }
  updates_.set_update_time(parts_.settings.update_time);
  std::vector<std::uint16_t> tpdos;
  for (const std::uint32_t position : entries) {
    const image::Entry& entry = layout.entries[position];
    if (!keep) {
      const std::uint32_t of_pdo =
          parts_.image.entries_of(Direction::outputs, entry.local_pdo).count;
      updates_.written(entry, of_pdo, asks_at_once(entry.local_pdo), now);
    }
    if (tpdos.empty() || tpdos.back() != entry.local_pdo) {
      tpdos.push_back(entry.local_pdo);
    }
  }
  request_updated(now);
  answer_write(std::move(command), tpdos, keep, now);
}

Refusal OutputService::check_by_pdo(const ObjectWrite& request,
                                    std::span<const std::uint32_t> entries) const {
  if (!parts_.receivers.takes_single_writes(request.node)) {
    return Refusal::wrong_state;
  }
  for (const std::uint32_t entry : entries) {
    if (outputs_.is_bound(entry)) {
      return Refusal::bound_entry;
    }
    if (request.data.size() != byte_length(this->entries()[entry])) {
      return Refusal::bad_request;
    }
  }
  return Refusal::none;
}

// The value would not be that which the reaction of the watchdog left. The reply names the group.
void OutputService::refuse_fired(const Command& command, std::uint32_t entry, Instant now) {
  host().refuse(command, Refusal::wrong_state, now, entries()[entry].node,
                fired_group_of(entry, outputs_));
}

// Answers after a value was written to these TPDOs of the line: with the worst reason, and the
// first TPDO that has it. keep: they wait for a trigger.
void OutputService::answer_write(Command command, std::span<const std::uint16_t> tpdos, bool keep,
                                 Instant now) {
  WrittenByPdo way{.pdo = tpdos.front(), .wait = PdoWait::none};
  for (const std::uint16_t tpdo : tpdos) {
    const PdoWait wait = keep ? PdoWait::trigger : wait_of(tpdo);
    if (is_worse(wait, way.wait)) {
      way = way_of(tpdo, wait);
    }
  }
  if (way.wait != PdoWait::none) {
    host().reply(command.tag, Error{}, std::move(way));
    return;
  }
  FramesUnderWay::Sending sending{
      .command = std::move(command), .frames = {}, .data = std::move(way)};
  for (const std::uint16_t tpdo : tpdos) {
    sending.frames.push_back({.tpdo = tpdo, .samples = parts_.node.pdos().samples(tpdo)});
  }
  host().answer_when_sent(std::move(sending), now);
}

// Answers for an output that is an object of the own node. keep: see answer_write().
void OutputService::answer_own(Command command, std::uint32_t entry, bool keep, Instant now) {
  std::vector<FramesUnderWay::Awaited> frames = own_.frames_of(entry);
  if (frames.empty()) {
    host().reply(command.tag, Error{}, {});  // read by SDO
    return;
  }
  const std::uint16_t tpdo = frames.front().sender();
  const PdoWait wait = keep ? PdoWait::trigger : wait_of(tpdo);
  if (wait != PdoWait::none) {
    host().reply(command.tag, Error{}, way_of(tpdo, wait));
    return;
  }
  host().answer_when_sent({.command = std::move(command),
                           .frames = std::move(frames),
                           .data = way_of(tpdo, wait),
                           .any_frame = true},
                          now);
}

WrittenByPdo OutputService::way_of(std::uint16_t tpdo, PdoWait wait) const {
  WrittenByPdo way{.pdo = tpdo, .wait = wait};
  const auto range = parts_.image.entries_of(Direction::outputs, tpdo);
  for (std::uint32_t i = range.first; wait == PdoWait::values && i < range.first + range.count;
       ++i) {
    if (!parts_.image.is_known(Direction::outputs, i)) {
      way.missing.push_back(i);
    }
  }
  return way;
}

PdoWait OutputService::wait_of(std::uint16_t tpdo) const {
  if (!parts_.image.pdo_known(Direction::outputs, tpdo)) {
    return PdoWait::values;
  }
  if (parts_.node.state() != nmt::State::operational) {
    return PdoWait::operational;
  }
  return updates_.waits(tpdo) ? PdoWait::update_time : PdoWait::none;
}

// A PDO with an event timer is sent anyway, so its values are not collected. For a PDO without a
// communication record the event timer of the plan applies.
bool OutputService::asks_at_once(std::uint16_t tpdo) const {
  constexpr std::uint8_t kEventTimer = 5;
  if (parts_.settings.update_time == Duration::zero()) {
    return true;
  }
  if (tpdo > pdo::kMaxPdo) {
    return parts_.plan.tpdos[tpdo - 1U].parameters.event_timer != Duration::zero();
  }
  const auto index = static_cast<std::uint16_t>(od::objects::kTpdoCommunication + tpdo - 1);
  return parts_.node.dictionary().number({index, kEventTimer}).value_or(0) != 0;
}

void OutputService::request_updated(Instant now) {
  for (PdoUpdates::Due due = updates_.expire(now); due.pdo != 0; due = updates_.expire(now)) {
    parts_.node.pdos().outputs_written(due.bit_offset, due.bits, true, now);
  }
}

// Replies with the present reason why the value waits.
void OutputService::answer_unsent(FramesUnderWay::Sending& sending, Instant now) {
  const bool stuck = host().bus_is_stuck(now);
  const nmt::State own = parts_.node.state();
  if (std::holds_alternative<PdoTrigger>(sending.command.request)) {
    host().refuse(sending.command, why_unsent(sending, own, stuck), now);
    return;
  }
  const FramesUnderWay::Awaited& awaited = sending.frames.front();
  if (sending.is_gone()) {
    host().refuse(sending.command, Refusal::wrong_state, now);
    return;
  }
  if (sending.any_frame) {  // an object of the own node
    const PdoWait on_the_way = sending.is_handed_out() || stuck ? PdoWait::bus : PdoWait::turn;
    const PdoWait wait = own == nmt::State::operational ? on_the_way : PdoWait::operational;
    const auto& way = std::get<WrittenByPdo>(sending.data);
    host().reply(sending.command.tag, Error{}, way_of(way.pdo, wait));
    return;
  }
  // 0: of a TPDO that carries objects of the own node
  const std::uint8_t receiving = parts_.image.node_of(Direction::outputs, awaited.tpdo);
  if (receiving != 0 && !parts_.receivers.takes_single_writes(receiving)) {
    host().refuse(sending.command, Refusal::wrong_state, now, receiving);
    return;
  }
  host().reply(sending.command.tag, Error{}, way_of_unsent(sending.frames, stuck));
}

// The worst reason of the TPDOs whose frames were not acknowledged: of those without a frame on the
// bus; if there is none, of the last frame, because frames are acknowledged in their order.
WrittenByPdo OutputService::way_of_unsent(std::span<const FramesUnderWay::Awaited> frames,
                                          bool stuck) const {
  const auto last = std::ranges::max_element(frames, {}, &FramesUnderWay::Awaited::number);
  const bool any_waits =
      std::ranges::find(frames, 0U, &FramesUnderWay::Awaited::number) != frames.end();
  WrittenByPdo way;
  for (const FramesUnderWay::Awaited& awaited : frames) {
    if (any_waits ? awaited.number != 0 : &awaited != &*last) {
      continue;
    }
    const PdoWait held_back = wait_of(awaited.tpdo);
    const PdoWait on_the_way = awaited.number != 0 || stuck ? PdoWait::bus : PdoWait::turn;
    const PdoWait wait = held_back == PdoWait::none ? on_the_way : held_back;
    if (is_worse(wait, way.wait)) {
      way = way_of(awaited.tpdo, wait);
    }
  }
  return way;
}

// --- groups ---------------------------------------------------------------------------------

OutputRefusal OutputService::write(const OutputWrite& write, Instant now) {
  const OutputRefusal refusal =
      parts_.flying.is_passive() ? OutputRefusal::wrong_role : outputs_.check(write);
  if (refusal != OutputRefusal::none) {
    outputs_.note_refused({.refusal = refusal, .group = write.group, .client = write.client_number},
                          write.client, now);
    return refusal;
  }
  if (const auto before = outputs_.displaces(write)) {
    parts_.events.emit(
        {.time = now,
         .data = event::OutputOwner{
             .group = write.group, .client = write.client_number, .before = *before}});
  }
  if (outputs_.accept(write, now)) {
    parts_.events.emit(
        {.time = now,
         .data = event::OutputArmed{
             .group = write.group,
             .watchdog = std::chrono::duration_cast<std::chrono::milliseconds>(write.watchdog),
             .client = write.client_number}});
    if (!outputs_.any_silent()) {
      parts_.node.end_reported(kWatchdogEmcy, now);
    }
  }
  const Outputs::Group& group = *outputs_.group(write.group);
  apply(write, group.config.send_always || group.resends, now);
  if (group.resends) [[unlikely]] {
    note_if_complete(group);
  }
  return OutputRefusal::none;
}

bool OutputService::feed_watchdog(const OutputWrite& write, Instant now) {
  return !parts_.flying.is_passive() && outputs_.feed(write, now);
}

// Writes all bytes before requesting PDOs: a PDO never carries half of a write.
void OutputService::apply(const OutputWrite& write, bool always, Instant now) {
  for (const OutputValue& value : write.values) {
    parts_.image.write_entry(Direction::outputs, value.entry,
                             std::span(value.data).first(value.length));
  }
  for (const OutputBytes& run : write.bytes) {
    parts_.image.write_bytes(Direction::outputs, run.offset, run.data);
  }
  for (const OutputValue& value : write.values) {
    entry_written(value.entry, always, now);
  }
  for (const OutputBytes& run : write.bytes) {
    written(run.offset * 8U, static_cast<std::uint32_t>(run.data.size() * 8U), always, now);
  }
}

[[gnu::hot]] void OutputService::written(std::uint32_t bit_offset, std::uint32_t bits, bool always,
                                         Instant now) {
  parts_.node.pdos().outputs_written(bit_offset, bits, always, now);
  if (!own_.empty()) {
    own_.written(bit_offset, bits, always, now);
  }
}

[[gnu::hot]] void OutputService::entries_written(std::uint32_t first, std::uint32_t bits,
                                                 bool always, Instant now) {
  parts_.node.pdos().output_written(first, bits, always, now);
  if (!own_.empty()) {
    own_.written(entries()[first].bit_offset, bits, always, now);
  }
}

void OutputService::apply_defaults(Instant now) {
  for (const OutputDefault& value : config_.defaults) {
    parts_.image.write_entry(Direction::outputs, value.entry, value.value);
  }
  for (const OutputDefault& value : config_.defaults) {
    entry_written(value.entry, true, now);
  }
}

void OutputService::note_if_complete(const Outputs::Group& group) {
  const auto is_known = [this](std::uint32_t entry) {
    return parts_.image.is_known(Direction::outputs, entry);
  };
  if (std::ranges::all_of(group.config.entries, is_known)) {
    outputs_.note_complete(group.config.number);
  }
}

void OutputService::give_up(Instant now) {
  for (const CommandKind kind : commands()) {
    host().refuse_unsent(kind, Refusal::wrong_role, now);
  }
  outputs_.disarm();
  parts_.node.end_reported(kWatchdogEmcy, now);
  for (const Outputs::Group& group : outputs_.groups()) {
    for (const std::uint32_t entry : group.config.entries) {
      parts_.image.forget_entry(Direction::outputs, entry);
    }
  }
  own_.give_up();
  // Entries that follow inputs keep their values.
  for (const OutputDefault& value : config_.defaults) {
    if (!outputs_.is_bound(value.entry)) {
      parts_.image.write_entry(Direction::outputs, value.entry, value.value);
    }
  }
  for (const OutputDefault& value : config_.defaults) {
    if (!outputs_.is_bound(value.entry)) {
      entry_written(value.entry, true, now);
    }
  }
}

// Precondition: the entry is not valid.
OutputWait OutputService::reason_of(std::uint32_t entry, Instant now) const {
  LINEGATE_ASSERT(!parts_.image.is_valid(Direction::outputs, entry), "the entry waits");
  const image::Entry& place = entries()[entry];
  const pdo::Engine& pdos = std::as_const(parts_.node).pdos();
  if (!parts_.image.is_known(Direction::outputs, entry)) {
    return OutputWait::value;
  }
  if (!parts_.image.pdo_known(Direction::outputs, place.local_pdo)) {
    return OutputWait::values;
  }
  if (parts_.node.state() != nmt::State::operational) {
    return OutputWait::own_node;
  }
  const bool stuck = host().bus_is_stuck(now);
  if (place.local_pdo == 0) {
    return own_.reason_of(entry, stuck);
  }
  using enum pdo::Engine::Receiver;
  const pdo::Engine::Receiver state = parts_.receivers.state(place.node);
  if (state == waiting || state == unheard || state == unlike) {
    return OutputWait::node;
  }
  if (updates_.waits(place.local_pdo)) {
    return OutputWait::update_time;
  }
  return wait_of_request(pdos.awaits_trigger(place.local_pdo, place.bit_offset, place.bit_length),
                         stuck);
}

void OutputService::describe(std::size_t position, OutputState& out, Instant now) const {
  outputs_.describe(position, out);
  add_waits(
      outputs_.groups()[position], parts_.image,
      [&](std::uint32_t entry) { return reason_of(entry, now); }, out);
}

void OutputService::expire_watchdogs(Instant now) {
  while (const Outputs::Group* group = outputs_.expire(now)) {
    react(*group, now);
  }
}

// Reactions that do not apply to the role are ignored (IXXAT manual 5.17); the event has those that
// were executed: NMT commands and an EMCY if they are sent or queued.
void OutputService::react(const Outputs::Group& group, Instant now) {
  std::uint8_t taken = kHoldOutputs;
  if ((group.reactions & kZeroOutputs) != 0) {
    zero(group, now);
    taken |= kZeroOutputs;
  }
  for (const NmtReaction& reaction : kNmtReactions) {
    if ((group.reactions & reaction.bit) != 0 &&
        parts_.nmt.send_to_others(reaction.command, 0, now)) {
      taken |= reaction.bit;
    }
  }
  if ((group.reactions & kSendEmcy) != 0) {
    const emcy::SendResult result =
        parts_.node.report_error(kWatchdogEmcy, kWatchdogRegister, {}, now);
    const bool sent = result == emcy::SendResult::sent || result == emcy::SendResult::queued;
    if (sent && !host().is_silent()) {
      taken |= kSendEmcy;
    }
  }
  if ((group.reactions & kHeartbeatOff) != 0 && !host().manages() && !host().is_silent()) {
    parts_.node.dictionary().set({od::objects::kProducerHeartbeatTime, 0}, std::uint16_t{0});
    taken |= kHeartbeatOff;
  }
  parts_.events.emit(
      {.time = now,
       .data = event::OutputWatchdog{.group = group.config.number, .reactions = taken}});
}

// An entry that was never written stays unknown: its PDO is still held back.
void OutputService::zero(const Outputs::Group& group, Instant now) {
  for (const std::uint32_t entry : group.config.entries) {
    if (parts_.image.is_known(Direction::outputs, entry)) {
      const std::vector<std::byte> zeros(byte_length(entries()[entry]));
      parts_.image.write_entry(Direction::outputs, entry, zeros);
    }
  }
  for (const std::uint32_t entry : group.config.entries) {
    entry_written(entry, true, now);
  }
}

// --- values of other lines ------------------------------------------------------------------

[[gnu::hot]] void OutputService::write_bound_entry(const BoundValue& value) {
  if (entries()[value.entry].bit_length <= 64) [[likely]] {
    parts_.image.write_entry(Direction::outputs, value.entry, value.value);
  } else {
    parts_.image.write_part(Direction::outputs, value.entry, value.part, value.value);
  }
}

[[gnu::hot]] void OutputService::write_bound(std::span<const BoundValue> values, Instant now) {
  bool any_forwarded = false;
  for (const BoundValue& value : values) {
    parts_.routed.values += value.always && value.part == 0 ? 1U : 0U;
    if ((value.entry & Line::kForwarded) != 0) {
      const std::size_t object = value.entry & ~Line::kForwarded;
      any_forwarded = true;
      parts_.node.dictionary().set(config_.forwarding.objects[object].address, value.value);
    } else if (value.valid) {
      write_bound_entry(value);
    } else {
      parts_.image.forget_entry(Direction::outputs, value.entry);
    }
  }
  // Adjacent values of a PDO are reported as one range: the PDO is then sampled once.
  const std::vector<image::Entry>& places = entries();
  for (std::size_t i = 0; i < values.size();) {
    const BoundValue& value = values[i++];
    if ((value.entry & Line::kForwarded) != 0) {
      continue;
    }
    const image::Entry& first = places[value.entry];
    std::uint32_t bits = first.bit_length;
    const auto is_part = [&](std::size_t next) {
      return values[next].entry == values[next - 1].entry;
    };
    const auto follows = [&](const BoundValue& next) {
      return next.always == value.always && (next.entry & Line::kForwarded) == 0 &&
             places[next.entry].bit_offset == first.bit_offset + bits &&
             places[next.entry].local_pdo == first.local_pdo;
    };
    for (; i < values.size() && (is_part(i) || follows(values[i])); ++i) {
      bits += is_part(i) ? 0U : places[values[i].entry].bit_length;
    }
    entries_written(value.entry, bits, value.always, now);
  }
  if (any_forwarded) {
    request_forwarded(values, now);
  }
}

// Requests once for each received PDO, see Forwarding::feeds_every_tpdo.
void OutputService::request_forwarded(std::span<const BoundValue> values, Instant now) {
  pdo::Engine& pdos = parts_.node.pdos();
  parts_.forwarded.follow(parts_.node.dictionary(), pdos.revision());
  const auto of_same_pdo = [](const BoundValue& a, const BoundValue& b) {
    return (b.entry & Line::kForwarded) != 0 && b.always && a.source == b.source;
  };
  for (std::size_t i = 0; i < values.size(); ++i) {
    const BoundValue& value = values[i];
    const auto done = [&](const BoundValue& before) { return of_same_pdo(value, before); };
    if (!of_same_pdo(value, value) || std::ranges::any_of(values.first(i), done)) {
      continue;
    }
    std::uint16_t first = 0;
    for (const BoundValue& other : values.subspan(i)) {
      if (!of_same_pdo(value, other)) {
        continue;
      }
      for (const std::uint16_t tpdo : parts_.forwarded.tpdos(other.entry & ~Line::kForwarded)) {
        first = first == 0 ? tpdo : std::min(first, tpdo);
        if (config_.forwarding.feeds_every_tpdo) {
          pdos.trigger(tpdo, now);
        }
      }
    }
    if (!config_.forwarding.feeds_every_tpdo && first != 0) {
      pdos.trigger(first, now);
    }
  }
}

// --- PDOs that are triggered by hand --------------------------------------------------------

// The TPDO by its number on this line or as an RPDO of the node, or all that carry that byte.
std::vector<std::uint16_t> OutputService::tpdos_of(const PdoTrigger& what) const {
  std::vector<std::uint16_t> out;
  if (what.node == 0 && !what.output_byte) {
    if (what.number != 0) {
      out.push_back(what.number);
    }
    return out;
  }
  const std::uint64_t bit = std::uint64_t{what.output_byte.value_or(0)} * 8U;
  const auto carries = [bit](const pdo::LinkTarget& target) {
    return target.image_bit < bit + 8 && bit < std::uint64_t{target.image_bit} + target.bits;
  };
  for (const pdo::LinkedPdo& tpdo : parts_.plan.tpdos) {
    const bool named = what.output_byte ? std::ranges::any_of(tpdo.targets, carries)
                                        : tpdo.node == what.node && tpdo.remote_pdo == what.number;
    if (named) {
      out.push_back(tpdo.parameters.number);
    }
  }
  return out;
}

Error OutputService::trigger(const PdoTrigger& what, std::vector<std::uint16_t>& triggered,
                             Instant now) {
  if (parts_.flying.is_passive()) {
    return to_error(Refusal::wrong_role);
  }
  if (parts_.node.state() != nmt::State::operational) {
    return to_error(Refusal::wrong_state);
  }
  bool known = false;
  for (const std::uint16_t tpdo : tpdos_of(what)) {
    const bool held_back = !parts_.image.pdo_known(Direction::outputs, tpdo);
    if (!held_back && !parts_.node.pdos().trigger(tpdo, now)) {
      continue;
    }
    known = true;
    if (!held_back) {
      updates_.forget(tpdo);
      triggered.push_back(tpdo);
    }
  }
  if (!known) {
    return to_error(Refusal::unknown_entry);
  }
  return triggered.empty() ? to_error(Refusal::wrong_state) : Error{};
}

AbortCode OutputService::may_trigger(const PdoTrigger& what) const {
  if (parts_.flying.is_passive()) {
    return AbortCode::local_control;
  }
  const std::vector<std::uint16_t> tpdos = tpdos_of(what);
  if (tpdos.empty()) {
    return AbortCode::invalid_value;
  }
  const bool complete = std::ranges::any_of(tpdos, [this](std::uint16_t tpdo) {
    return parts_.image.pdo_known(Direction::outputs, tpdo);
  });
  return complete && parts_.node.state() == nmt::State::operational ? AbortCode::none
                                                                    : AbortCode::device_state;
}

void OutputService::answer_trigger(Command command, Instant now) {
  TriggeredPdos triggered;
  const auto& request = std::get<PdoTrigger>(command.request);
  if (const Error why = trigger(request, triggered, now); why != Error{}) {
    host().answer(command, why, {}, now);
    return;
  }
  FramesUnderWay::Sending sending{.command = std::move(command), .frames = {}};
  for (const std::uint16_t tpdo : triggered) {
    sending.frames.push_back({.tpdo = tpdo});
  }
  sending.data = std::move(triggered);
  host().answer_when_sent(std::move(sending), now);
}

}  // namespace linegate::line
