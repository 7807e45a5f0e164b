// SPDX-License-Identifier: Apache-2.0
#include "gateway/publish/named_samples.h"

#include <algorithm>
#include <iterator>

#include "bridges/named/described_type.h"
#include "bridges/named/ros2_types.h"

namespace linegate::gateway {

NamedSamples::NamedSamples(const config::LinePlan& plan)
    : line_(plan.config.name),
      aliases_(plan.named.aliases),
      always_(plan.publish.rule != config::Publish::Rule::on_change),
      min_separation_(plan.named.min_separation),
      ros2_(plan.named.ros2),
      described_(plan.named.type_information) {
}

std::vector<std::string> NamedSamples::use(const image::Layout& layout) {
  const std::vector<named::DeviceType> before = std::exchange(types_, {});
  std::vector<State> states = std::exchange(states_, {});
  slots_.clear();
  waits_.assign(layout.entries.size(), named::kUnknownWait);
  named::DeviceTypes made = named::device_types(line_, layout, aliases_);
  types_ = std::move(made.types);
  for (named::DeviceType& type : types_) {
    type.described = described_ && named::can_be_described(type);
  }
  if (ros2_) {
    add_ros2_types(made.collisions);
  }
  for (std::size_t i = 0; i < types_.size(); ++i) {
    const auto same = std::ranges::find(before, types_[i].name, &named::DeviceType::name);
    if (same != before.end()) {
      states_.push_back(std::move(states[static_cast<std::size_t>(same - before.begin())]));
    } else {
      states_.emplace_back();
      states_.back().times.resize(types_[i].pdos.size());
      states_.back().marks.resize(2 * types_[i].members.size());
      if (layout.direction == image::Direction::outputs) {
        states_.back().waits.resize(types_[i].members.size(), named::kUnknownWait);
      }
    }
    add_slots(layout, i);
  }
  std::ranges::sort(slots_, {}, &Slot::local_pdo);
  return std::move(made.collisions);
}

void NamedSamples::add_ros2_types(std::vector<std::string>& collisions) {
  named::Ros2Types made = named::ros2_types(types_);
  std::ranges::move(made.types, std::back_inserter(types_));
  std::ranges::move(made.collisions, std::back_inserter(collisions));
}

void NamedSamples::add_slots(const image::Layout& layout, std::size_t type) {
  const std::vector<std::uint16_t>& pdos = types_[type].pdos;
  for (const named::Member& member : types_[type].members) {
    const std::uint16_t local = layout.entries[member.entry].local_pdo;
    const auto place = std::ranges::lower_bound(pdos, member.pdo);
    const bool known =
        !slots_.empty() && slots_.back().local_pdo == local && slots_.back().type == type;
    if (local != 0 && member.pdo != 0 && !known) {
      slots_.push_back({local, type, static_cast<std::size_t>(place - pdos.begin())});
    }
  }
}

void NamedSamples::note_times(const image::Snapshot& snapshot) {
  for (const image::PdoMark& mark : snapshot.marks) {
    auto slot = std::ranges::lower_bound(slots_, mark.local_pdo, {}, &Slot::local_pdo);
    for (; slot != slots_.end() && slot->local_pdo == mark.local_pdo; ++slot) {
      states_[slot->type].times[slot->time] = mark.time;
    }
  }
}

bool NamedSamples::update_marks(std::size_t type, const image::Snapshot& snapshot) {
  State& state = states_[type];
  const bool is_output = types_[type].direction == image::Direction::outputs;
  bool differs = false;
  for (std::size_t i = 0; i < types_[type].members.size(); ++i) {
    const std::uint32_t entry = types_[type].members[i].entry;
    const bool valid = snapshot.is_valid(entry);
    const bool known = is_output && snapshot.is_known(entry);
    differs = differs || state.marks[2 * i] != valid || state.marks[2 * i + 1] != known;
    state.marks[2 * i] = valid;
    state.marks[2 * i + 1] = known;
  }
  return differs;
}

bool NamedSamples::is_changed(std::size_t type, const image::Snapshot& snapshot) const {
  return std::ranges::any_of(types_[type].members, [&](const named::Member& member) {
    return snapshot.is_changed(member.entry);
  });
}

void NamedSamples::note(const image::Snapshot& snapshot) {
  note_times(snapshot);
  for (std::size_t i = 0; i < types_.size(); ++i) {
    State& state = states_[i];
    if (state.is_read) {
      const bool other_marks = update_marks(i, snapshot);
      state.is_due = state.is_due || always_ || other_marks || is_changed(i, snapshot);
    }
  }
}

void NamedSamples::note_waits(std::span<const line::OutputState> groups) {
  std::ranges::fill(waits_, named::kUnknownWait);
  for (const line::OutputState& group : groups) {
    for (const line::OutputState::Wait& wait : group.waits) {
      if (wait.entry < waits_.size()) {
        waits_[wait.entry] = static_cast<std::uint8_t>(1 + static_cast<unsigned>(wait.reason));
      }
    }
  }
  for (std::size_t i = 0; i < types_.size(); ++i) {
    std::vector<std::uint8_t>& waits = states_[i].waits;
    for (std::size_t m = 0; m < waits.size(); ++m) {
      const std::uint8_t why = waits_[types_[i].members[m].entry];
      states_[i].is_due = states_[i].is_due || why != waits[m];
      waits[m] = why;
    }
  }
}

}  // namespace linegate::gateway
