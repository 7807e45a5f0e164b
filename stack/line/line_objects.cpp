// SPDX-License-Identifier: Apache-2.0
// Data of devices by object, by PDO where it goes by PDO (CANopenIA manual 5.1), PDOs that are
// triggered by hand (IXXAT CANopen Manager API manual 6.1.6), and objects of the own dictionary
// that applications create.
#include <algorithm>
#include <utility>

#include "stack/base/byte_order.h"
#include "stack/line/entry_bytes.h"
#include "stack/line/line_impl.h"
#include "stack/od/objects.h"

namespace linegate::line {
namespace {

using image::Direction;

constexpr Error kGood{};

// Positions of the entries that are the object, ascending.
std::vector<std::uint32_t> entries_of(const image::Layout& layout, const Command& command) {
  std::vector<std::uint32_t> out;
  for (std::uint32_t i = 0; i < layout.entries.size(); ++i) {
    const image::Entry& entry = layout.entries[i];
    if (entry.node == command.node && entry.index == command.index && entry.sub == command.sub) {
      out.push_back(i);
    }
  }
  return out;
}

}  // namespace

void Line::Impl::write_object(Command command, Instant now) {
  if ((command.code & ~(kForceSdo | kKeepPdo)) != 0) {
    refuse(command, Refusal::bad_request, now);
    return;
  }
  const std::vector<std::uint32_t> entries = entries_of(image.layout(Direction::outputs), command);
  const bool by_sdo = (command.code & kForceSdo) != 0 || records.settings().enforce_sdo;
  if (entries.empty() || by_sdo) {
    start_sdo(std::move(command), true, now);
    return;
  }
  write_by_pdo(std::move(command), entries, now);
}

// Every PDO that maps it gets it.
void Line::Impl::write_by_pdo(Command command, std::span<const std::uint32_t> entries,
                              Instant now) {
  const image::Layout& layout = image.layout(Direction::outputs);
  if (const Refusal why = check_write_by_pdo(command, entries); why != Refusal::none) {
    refuse(command, why, now);
    return;
  }
  for (const std::uint32_t entry : entries) {
    image.write_entry(Direction::outputs, entry, command.data);
  }
  const bool keep = (command.code & kKeepPdo) != 0 || records.settings().manual_trigger;
  updates.set_update_time(records.settings().update_time);
  for (const std::uint32_t position : entries) {
    const image::Entry& entry = layout.entries[position];
    if (!keep) {
      const std::uint32_t of_pdo = image.entries_of(Direction::outputs, entry.local_pdo).count;
      updates.written(entry, of_pdo, asks_at_once(entry.local_pdo), now);
    }
  }
  const std::uint16_t pdo = layout.entries[entries.front()].local_pdo;
  ask_for_updated(now);
  answer_write(std::move(command), pdo, keep ? PdoWait::trigger : wait_of(pdo), now);
}

Refusal Line::Impl::check_write_by_pdo(const Command& command,
                                       std::span<const std::uint32_t> entries) const {
  if (!takes_single_writes(command.node)) {
    return Refusal::wrong_state;
  }
  for (const std::uint32_t entry : entries) {
    if (outputs.is_bound(entry)) {
      return Refusal::bound_entry;
    }
    if (command.data.size() != byte_length(image.layout(Direction::outputs).entries[entry])) {
      return Refusal::bad_request;
    }
  }
  return Refusal::none;
}

std::vector<std::byte> Line::Impl::way_of(std::uint16_t tpdo, PdoWait wait) const {
  std::vector<std::byte> way = encode_way(tpdo, wait);
  const auto range = image.entries_of(Direction::outputs, tpdo);
  for (std::uint32_t i = range.first; wait == PdoWait::values && i < range.first + range.count;
       ++i) {
    if (!image.is_known(Direction::outputs, i)) {
      way.resize(way.size() + sizeof i);
      store_le(way.data() + way.size() - sizeof i, i);
    }
  }
  return way;
}

// What an event timer sends anyway is not collected. PDOs without a record have that of the plan.
bool Line::Impl::asks_at_once(std::uint16_t tpdo) {
  constexpr std::uint8_t kEventTimer = 5;
  if (records.settings().update_time == Duration::zero()) {
    return true;
  }
  if (tpdo > pdo::kMaxPdo) {
    return plan.tpdos[tpdo - 1U].parameters.event_timer != Duration::zero();
  }
  const auto index = static_cast<std::uint16_t>(od::objects::kTpdoCommunication + tpdo - 1);
  return node.dictionary().number({index, kEventTimer}).value_or(0) != 0;
}

PdoWait Line::Impl::wait_of(std::uint16_t tpdo) const {
  if (!image.pdo_known(Direction::outputs, tpdo)) {
    return PdoWait::values;
  }
  if (node.state() != nmt::State::operational) {
    return PdoWait::operational;
  }
  return updates.waits(tpdo) ? PdoWait::update_time : PdoWait::none;
}

void Line::Impl::ask_for_updated(Instant now) {
  for (PdoUpdates::Due due = updates.expire(now); due.pdo != 0; due = updates.expire(now)) {
    node.pdos().outputs_written(due.bit_offset, due.bits, true, now);
  }
}

Error Line::Impl::create_object(const Command& command) {
  if (command.code == kRemoveObject) {
    return own_objects.remove(node.dictionary(), command.index);
  }
  auto object = decode_own_object(command);
  if (command.code != kCreateObject || !object) {
    return to_error(Refusal::bad_request);
  }
  return own_objects.create(node.dictionary(), *std::move(object));
}

bool Line::Impl::answer_from_image(const Command& command) {
  const image::Layout& layout = image.layout(Direction::inputs);
  for (const std::uint32_t position : entries_of(layout, command)) {
    const image::Entry& entry = layout.entries[position];
    const std::size_t size = byte_length(entry);
    if (size > sizeof(std::uint64_t) || !image.is_valid(Direction::inputs, position) ||
        node.pdos().timed_out(entry.local_pdo)) {
      continue;
    }
    std::vector<std::byte> data(size);
    store_le(std::span(data), image.read_entry(Direction::inputs, position));
    reply(command.tag, kGood, std::move(data));
    return true;
  }
  return false;
}

// By the number that a PDO has here or as an RPDO of the node, or all that carry that byte.
std::vector<std::uint16_t> Line::Impl::named_tpdos(const Command& command) const {
  std::vector<std::uint16_t> out;
  if (command.node == 0 && command.code != 0) {
    out.push_back(command.code);
    return out;
  }
  const std::uint64_t bit = std::uint64_t{command.entry} * 8U;
  const auto carries = [bit](const pdo::LinkTarget& target) {
    return target.image_bit < bit + 8 && bit < std::uint64_t{target.image_bit} + target.bits;
  };
  for (const pdo::LinkedPdo& tpdo : plan.tpdos) {
    const bool named = command.node != 0
                           ? tpdo.node == command.node && tpdo.remote_pdo == command.code
                           : std::ranges::any_of(tpdo.targets, carries);
    if (named) {
      out.push_back(tpdo.parameters.number);
    }
  }
  return out;
}

// Those that lack a value are not sent, and the answer does not have them.
Error Line::Impl::trigger_pdos(const Command& command, std::vector<std::uint16_t>& triggered,
                               Instant now) {
  if (node.state() != nmt::State::operational) {
    return to_error(Refusal::wrong_state);
  }
  bool known = false;
  for (const std::uint16_t tpdo : named_tpdos(command)) {
    const bool held_back = !image.pdo_known(Direction::outputs, tpdo);
    if (!held_back && !node.pdos().trigger(tpdo, now)) {
      continue;
    }
    known = true;
    if (!held_back) {
      updates.forget(tpdo);
      triggered.push_back(tpdo);
    }
  }
  if (!known) {
    return to_error(Refusal::unknown_entry);
  }
  return triggered.empty() ? to_error(Refusal::wrong_state) : kGood;
}

void Line::Impl::answer_trigger(const Command& command, Instant now) {
  std::vector<std::uint16_t> triggered;
  if (const Error why = trigger_pdos(command, triggered, now); why != kGood) {
    answer(command, why, {}, now);
    return;
  }
  FramesUnderWay::Sending sending{.command = command, .frames = {}};
  for (const std::uint16_t tpdo : triggered) {
    sending.frames.push_back({.tpdo = tpdo});
    sending.data.resize(sending.data.size() + sizeof tpdo);
    store_le(sending.data.data() + sending.data.size() - sizeof tpdo, tpdo);
  }
  answer_when_sent(std::move(sending), now);
}

}  // namespace linegate::line
