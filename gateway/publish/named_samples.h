// SPDX-License-Identifier: Apache-2.0
// Selects the samples of named topics (bridges/named) that a process image makes due.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "bridges/named/device_types.h"
#include "gateway/config/plant.h"
#include "gateway/publish/values.h"
#include "stack/base/time.h"
#include "stack/image/layout.h"
#include "stack/image/snapshot.h"
#include "stack/line/output_state.h"

namespace linegate::gateway {

// Of one direction of a line. A device's sample is due if one of its values changed, or a mark of
// one; with the rules on_sync and period, with each published image; and if its topic has readers
// again. While a topic has no readers, it has no samples, and its values are not compared. Samples
// of a topic are numbered without gaps, until its type changes.
class NamedSamples {
 public:
  explicit NamedSamples(const config::LinePlan& plan);

  // The types of a new layout. Numbers and times of a type that remains continue. Returns sentences
  // about devices that have none.
  std::vector<std::string> use(const image::Layout& layout);
  std::span<const named::DeviceType> types() const { return types_; }

  // has_readers(type): whether the topic of the type has readers now. A new type is considered read
  // until this is called.
  template <class HasReaders>
  void update_readers(HasReaders has_readers) {
    for (std::size_t i = 0; i < types_.size(); ++i) {
      const bool before = std::exchange(states_[i].is_read, has_readers(types_[i]));
      states_[i].is_due = states_[i].is_due || (states_[i].is_read && !before);
    }
  }

  // The snapshot is one that is published, of the layout in use.
  void note(const image::Snapshot& snapshot);
  // Of the outputs: what those that are not valid wait for, of all groups. A sample is due if that
  // of one of its members changed. An entry in no group, and one behind the first
  // OutputState::kMostWaits of its group, has no reason.
  void note_waits(std::span<const line::OutputState> groups);

  // Calls emit(sample) for each sample that is due, unless the minimum separation from the one
  // before has not passed, or accepts(type) is false (at_once: regardless of both). The snapshot
  // has the newest values, in the layout in use. Returns when it must be called again.
  template <class Accepts, class Emit>
  Instant emit_due(const image::Snapshot& snapshot, Instant now, bool at_once, Accepts accepts,
                   Emit emit) {
    Instant next = kNever;
    for (std::size_t i = 0; i < types_.size(); ++i) {
      State& state = states_[i];
      if (!state.is_due || !state.is_read) {
        continue;
      }
      if (now < state.earliest && !at_once) {
        next = earlier(next, state.earliest);
        continue;
      }
      if (!at_once && !accepts(types_[i])) {
        next = earlier(next, now + kRetry);
        continue;
      }
      update_marks(i, snapshot);
      state.is_due = false;
      state.earliest = now + min_separation_;
      emit(NamedSample{types_[i], ++state.number, state.times, state.waits});
    }
    return next;
  }

 private:
  static constexpr Duration kRetry = std::chrono::milliseconds(5);

  struct State {
    std::uint64_t number = 0;
    std::vector<Instant> times;       // of the PDOs of the type
    std::vector<bool> marks;          // of each member: valid, known
    std::vector<std::uint8_t> waits;  // outputs: of each member
    bool is_read = true;
    bool is_due = true;
    Instant earliest{};  // of the next sample
  };
  // The time that a reception of a PDO of the gateway sets.
  struct Slot {
    std::uint16_t local_pdo = 0;
    std::size_t type = 0;
    std::size_t time = 0;
  };

  // Topics of ROS 2 beside the others, with samples and numbers of their own.
  void add_ros2_types(std::vector<std::string>& collisions);
  void add_slots(const image::Layout& layout, std::size_t type);
  void note_times(const image::Snapshot& snapshot);
  // Returns true if a mark differs from that of the last call.
  bool update_marks(std::size_t type, const image::Snapshot& snapshot);
  bool is_changed(std::size_t type, const image::Snapshot& snapshot) const;

  std::string line_;
  std::vector<named::Alias> aliases_;
  bool always_;
  Duration min_separation_;
  bool ros2_;
  bool described_;
  std::vector<named::DeviceType> types_;
  std::vector<State> states_;        // by type
  std::vector<std::uint8_t> waits_;  // of each entry of the outputs
  std::vector<Slot> slots_;          // ascending by local PDO
};

}  // namespace linegate::gateway
