// SPDX-License-Identifier: Apache-2.0
// Selects the samples of named topics (bridges/named) that a process image makes due.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "bridges/named/device_types.h"
#include "gateway/config/plant.h"
#include "gateway/publish/values.h"
#include "stack/image/layout.h"
#include "stack/image/snapshot.h"

namespace linegate::gateway {

// Of one direction of a line. A device's sample is due if one of its values changed, or a mark of
// one; with the rules on_sync and period, with each published image. Samples of a topic are
// numbered without gaps, until its type changes.
class NamedSamples {
 public:
  explicit NamedSamples(const config::LinePlan& plan);

  // The types of a new layout. Numbers and times of a type that remains continue. Returns sentences
  // about devices that have none.
  std::vector<std::string> use(const image::Layout& layout);
  std::span<const named::DeviceType> types() const { return types_; }

  // Calls emit(sample) for each sample that is due. The snapshot is one that is published, of the
  // layout in use.
  template <class Emit>
  void add(const image::Snapshot& snapshot, Emit emit) {
    note_times(snapshot);
    for (std::size_t i = 0; i < types_.size(); ++i) {
      if (note(i, snapshot)) {
        emit(NamedSample{types_[i], states_[i].number, states_[i].times});
      }
    }
  }

 private:
  struct State {
    std::uint64_t number = 0;
    std::vector<Instant> times;  // of the PDOs of the type
    std::vector<bool> marks;     // of each member: valid, known
  };
  // The time that a reception of a PDO of the gateway sets.
  struct Slot {
    std::uint16_t local_pdo = 0;
    std::size_t type = 0;
    std::size_t time = 0;
  };

  void add_slots(const image::Layout& layout, std::size_t type);
  void note_times(const image::Snapshot& snapshot);
  // Returns true if the sample is due, and assigns its number.
  bool note(std::size_t type, const image::Snapshot& snapshot);

  std::string line_;
  std::vector<named::Alias> aliases_;
  bool always_;
  std::vector<named::DeviceType> types_;
  std::vector<State> states_;  // by type
  std::vector<Slot> slots_;    // ascending by local PDO
};

}  // namespace linegate::gateway
