// SPDX-License-Identifier: Apache-2.0
// Keeps the newest sample of each instance of a writer, and finds those that are too old compared
// with all samples written since. Independent of DDS; state_writer.h describes the reason.
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
  // The number of samples that may be written after the newest sample of an instance before that
  // one is stale. Twice the number of instances applies, if that is greater.
  static constexpr std::uint64_t kMostSince = 1'024;

  // Keeps and returns a copy of the sample that is about to be written.
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

  // The number of samples that are kept.
  std::size_t size() const { return held_.size(); }

  // Removes the samples for which wanted(sample) is true, and calls dropped(key, sample) for each.
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

  // Calls visit(sample) for all samples, oldest first. Writing them to another writer in this order
  // is not counted.
  template <class Visit>
  void each(Visit visit) {
    for (Held& held : held_)
      visit(held.sample);
  }

  // Returns a sample that must be written again now, and counts it as written; nullptr if there is
  // none. Call it after each note() until it returns nullptr.
  Sample* pop_stale() {
    const std::uint64_t most = std::max<std::uint64_t>(kMostSince, 2 * held_.size());
    if (held_.empty() || written_ - held_.front().number <= most)
      return nullptr;
    move_to_end(held_.begin());
    return &held_.back().sample;
  }

 private:
  struct Held {
    Sample sample;
    std::uint64_t number;  // number of the write operation, from 1
  };
  using Place = typename std::list<Held>::iterator;

  void move_to_end(Place place) {
    held_.splice(held_.end(), held_, place);
    place->number = ++written_;
  }

  std::list<Held> held_;  // in write order
  std::map<Key, Place> places_;
  std::uint64_t written_ = 0;
};

}  // namespace linegate::dds
