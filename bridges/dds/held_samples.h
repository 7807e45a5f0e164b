// SPDX-License-Identifier: Apache-2.0
// The newest sample of each instance of a writer, and which of them lies too far back among all
// that was written. Free of DDS; why it matters: state_writer.h.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <list>
#include <map>
#include <utility>

namespace linegate::dds {

template <class Key, class Sample>
class HeldSamples {
 public:
  // So many samples may have been written since the newest one of any instance; twice as many as
  // there are instances, if that is more.
  static constexpr std::uint64_t kMostSince = 1'024;

  // Keeps a copy of what is now being written, and gives it.
  Sample& note(const Key& key, const Sample& sample) {
    const auto known = places_.find(key);
    if (known == places_.end()) {
      held_.push_back({sample, ++written_});
      places_.emplace(key, std::prev(held_.end()));
    } else {
      move_to_end(known->second);
      held_.back().sample = sample;
    }
    return held_.back().sample;
  }

  // Those of which wanted(sample) is true are kept no longer: calls dropped(key, sample) for each.
  template <class Wanted, class Dropped>
  void drop(Wanted wanted, Dropped dropped) {
    for (auto place = places_.begin(); place != places_.end();) {
      if (!wanted(std::as_const(place->second->sample))) {
        ++place;
        continue;
      }
      dropped(place->first, place->second->sample);
      held_.erase(place->second);
      place = places_.erase(place);
    }
  }

  // All of them, oldest first. What is written of them now counts for nothing: it goes to another
  // writer, in the same order.
  template <class Visit>
  void each(Visit visit) {
    for (Held& held : held_)
      visit(held.sample);
  }

  // One that must be written again now, which counts as written; nullptr: none. Ask until there is
  // none, after each note().
  Sample* take_stale() {
    const std::uint64_t most = std::max<std::uint64_t>(kMostSince, 2 * held_.size());
    if (held_.empty() || written_ - held_.front().number <= most)
      return nullptr;
    move_to_end(held_.begin());
    return &held_.back().sample;
  }

 private:
  struct Held {
    Sample sample;
    std::uint64_t number;  // of the write, from 1
  };
  using Place = typename std::list<Held>::iterator;

  void move_to_end(Place place) {
    held_.splice(held_.end(), held_, place);
    place->number = ++written_;
  }

  std::list<Held> held_;  // in the order they were written
  std::map<Key, Place> places_;
  std::uint64_t written_ = 0;
};

}  // namespace linegate::dds
