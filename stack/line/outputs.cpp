// SPDX-License-Identifier: Apache-2.0
#include "stack/line/outputs.h"

#include <algorithm>
#include <bit>
#include <numeric>
#include <utility>

#include "stack/base/assert.h"
#include "stack/base/time.h"
#include "stack/line/entry_bytes.h"

namespace linegate::line {
namespace {

constexpr std::uint8_t kNmtBits =
    kNmtPreOperational | kNmtStop | kNmtResetCommunication | kNmtResetNode;
constexpr std::uint8_t kKnownReactions = kZeroOutputs | kNmtBits | kSendEmcy | kHeartbeatOff;

}  // namespace

bool valid_reactions(std::uint8_t reactions) {
  return (reactions & ~kKnownReactions) == 0 &&
         std::popcount(static_cast<unsigned>(reactions & kNmtBits)) <= 1;
}

Outputs::Outputs(const image::Layout& layout, std::vector<OutputGroup> groups,
                 const std::vector<std::uint32_t>& bound)
    : layout_(layout),
      group_of_(layout.entries.size(), kNoGroup),
      bound_(layout.entries.size()),
      by_position_(layout.entries.size()) {
  for (const std::uint32_t entry : bound) {
    bound_[entry] = true;
  }
  for (const OutputGroup& group : groups) {
    for (const std::uint32_t entry : group.entries) {
      bound_[entry] = bound_[entry] || group.forwarded;
    }
  }
  if (std::ranges::all_of(groups, &OutputGroup::forwarded)) {
    OutputGroup all{.number = 0, .name = "all"};
    all.entries.resize(layout.entries.size());
    std::iota(all.entries.begin(), all.entries.end(), 0U);
    std::erase_if(all.entries, [this](std::uint32_t entry) { return bound_[entry]; });
    groups.push_back(std::move(all));
  }
  for (OutputGroup& group : groups) {
    const auto position = static_cast<std::uint16_t>(groups_.size());
    for (const std::uint32_t entry : group.entries) {
      group_of_[entry] = position;
    }
    groups_.push_back({.config = std::move(group)});
  }
  std::iota(by_position_.begin(), by_position_.end(), 0U);
  std::ranges::sort(by_position_, {},
                    [this](std::uint32_t e) { return layout_.entries[e].bit_offset; });
}

OutputRefusal Outputs::check(const OutputWrite& write) const {
  const Group* target = group(write.group);
  if (target == nullptr) {
    return OutputRefusal::unknown_group;
  }
  if (write.forwarded != target->config.forwarded) {
    return OutputRefusal::bound_entry;
  }
  if (write.layout_id != layout_.id) {
    return OutputRefusal::stale_layout;
  }
  if (!valid_reactions(write.reactions) || write.watchdog < Duration::zero()) {
    return OutputRefusal::bad_reaction;
  }
  if (target->burnt == write.arming) {
    return OutputRefusal::not_armed;
  }
  const auto position = static_cast<std::uint16_t>(target - groups_.data());
  for (const OutputValue& value : write.values) {
    if (!in_group(value.entry, position)) {
      return foreign_entry(value.entry);
    }
    if (value.length != byte_length(layout_.entries[value.entry])) {
      return OutputRefusal::bad_length;
    }
  }
  for (const OutputBytes& run : write.bytes) {
    if (const OutputRefusal refusal = check_bytes(run, position); refusal != OutputRefusal::none) {
      return refusal;
    }
  }
  return OutputRefusal::none;
}

bool Outputs::accept(const OutputWrite& write, Instant now) {
  LINEGATE_ASSERT(find(write.group) != nullptr, "check() found the group");
  Group& target = *find(write.group);
  const bool first = !std::exchange(target.armed, true) || target.tripped;
  target.tripped = false;
  target.arming = write.arming;
  target.watchdog = write.watchdog;
  target.reactions = write.reactions;
  target.deadline = write.watchdog == Duration::zero() ? kNever : deadline(now, write.watchdog);
  follow_deadlines();
  target.owner = write.client;
  target.owner_number = write.client_number;
  ++target.applied;
  target.applied_at = now;
  return first;
}

std::optional<std::uint32_t> Outputs::displaces(const OutputWrite& write) const {
  const Group* const target = group(write.group);
  LINEGATE_ASSERT(target != nullptr, "check() found the group");
  const bool in_use = target->armed && !target->tripped;
  return in_use && target->owner_number != write.client_number ? std::optional(target->owner_number)
                                                               : std::nullopt;
}

bool Outputs::feed(const OutputWrite& write, Instant now) {
  if (check(write) != OutputRefusal::none) {
    return false;
  }
  Group& target = *find(write.group);
  if (target.deadline != kNever) {
    target.deadline = deadline(now, target.watchdog);
    follow_deadlines();
  }
  return true;
}

void Outputs::note_refused(const event::OutputRefused& refused, std::string_view client,
                           Instant now) {
  if (Group* target = find(refused.group)) {
    ++target->refused;
    target->refused_at = now;
    target->refusal = refused.refusal;
    target->refused_client = client;
    target->refused_number = refused.client;
  }
}

void Outputs::describe(std::size_t position, OutputState& out) const {
  LINEGATE_ASSERT(position < groups_.size(), "the group exists");
  const Group& from = groups_[position];
  out.group = from.config.number;
  out.name = from.config.name;
  out.owner = from.owner;
  out.applied = from.applied;
  out.refused = from.refused;
  out.applied_at = from.applied_at;
  out.refused_at = from.refused_at;
  out.refusal = from.refusal;
  out.refused_client = from.refused_client;
  out.refused_number = from.refused_number;
  out.arming = from.arming;
  out.arming_wanted = from.burnt == from.arming;
  out.watchdog = from.watchdog;
  out.deadline = from.deadline;
  out.waiting = 0;
  out.waits.clear();
}

bool Outputs::any_silent() const {
  return std::any_of(groups_.begin(), groups_.end(), [](const Group& group) {
    return group.tripped && (group.reactions & kSendEmcy) != 0;
  });
}

const Outputs::Group* Outputs::expire(Instant now) {
  for (Group& candidate : groups_) {
    if (candidate.deadline <= now) {
      candidate.deadline = kNever;
      candidate.tripped = true;
      candidate.burnt = candidate.arming;
      follow_deadlines();
      return &candidate;
    }
  }
  return nullptr;
}

void Outputs::disarm() {
  for (Group& each : groups_) {
    if (std::exchange(each.armed, false)) {
      each.burnt = each.arming;
    }
    each.tripped = false;
    each.resends = true;
    each.deadline = kNever;
  }
  follow_deadlines();
}

const Outputs::Group* Outputs::fired_group(std::uint32_t entry) const {
  const std::uint16_t position = entry < group_of_.size() ? group_of_[entry] : kNoGroup;
  return position != kNoGroup && groups_[position].tripped ? &groups_[position] : nullptr;
}

void Outputs::note_complete(std::uint16_t group) {
  LINEGATE_ASSERT(find(group) != nullptr, "the group exists");
  find(group)->resends = false;
}

void Outputs::follow_deadlines() {
  next_deadline_ = kNever;
  for (const Group& group : groups_) {
    next_deadline_ = earlier(next_deadline_, group.deadline);
  }
}

std::size_t Outputs::position_of(std::uint16_t number) const {
  const auto found =
      std::ranges::find(groups_, number, [](const Group& group) { return group.config.number; });
  return static_cast<std::size_t>(found - groups_.begin());
}

const Outputs::Group* Outputs::group(std::uint16_t number) const {
  const std::size_t position = position_of(number);
  return position < groups_.size() ? &groups_[position] : nullptr;
}

Outputs::Group* Outputs::find(std::uint16_t number) {
  const std::size_t position = position_of(number);
  return position < groups_.size() ? &groups_[position] : nullptr;
}

bool Outputs::in_group(std::uint32_t entry, std::uint16_t group_position) const {
  return entry < group_of_.size() && group_of_[entry] == group_position;
}

OutputRefusal Outputs::foreign_entry(std::uint32_t entry) const {
  return entry < bound_.size() && bound_[entry] ? OutputRefusal::bound_entry
                                                : OutputRefusal::unknown_entry;
}

// A run may cover gaps, but every entry that it overlaps must be in the group and completely in the
// run.
OutputRefusal Outputs::check_bytes(const OutputBytes& run, std::uint16_t group_position) const {
  if (run.data.empty() || run.offset > layout_.byte_size ||
      run.data.size() > layout_.byte_size - run.offset) {
    return OutputRefusal::bad_length;
  }
  const std::uint64_t begin = std::uint64_t{run.offset} * 8U;
  const std::uint64_t end = begin + run.data.size() * 8U;
  auto it = std::ranges::lower_bound(
      by_position_, begin, {}, [this](std::uint32_t e) { return layout_.entries[e].bit_offset; });
  if (it != by_position_.begin()) {
    --it;  // it starts before the run, but may extend into it
  }
  bool any = false;
  for (; it != by_position_.end() && layout_.entries[*it].bit_offset < end; ++it) {
    const image::Entry& entry = layout_.entries[*it];
    const std::uint64_t entry_end = std::uint64_t{entry.bit_offset} + entry.bit_length;
    if (entry_end <= begin) {
      continue;
    }
    if (!in_group(*it, group_position)) {
      return foreign_entry(*it);
    }
    if (entry.bit_offset < begin || entry_end > end) {
      return OutputRefusal::bad_length;
    }
    any = true;
  }
  return any ? OutputRefusal::none : OutputRefusal::unknown_entry;
}

}  // namespace linegate::line
