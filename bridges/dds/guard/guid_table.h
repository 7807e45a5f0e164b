// SPDX-License-Identifier: Apache-2.0
// A table of fixed size with GUIDs as keys. Discovered GUIDs keep their places, whatever else is
// received.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <mutex>
#include <random>

#include "bridges/dds/guard/wire.h"

namespace linegate::dds::guard {

// The entries are in sets of 8, selected by a keyed hash. In a full set, a new GUID replaces the
// least recently used one that is not pinned. From any thread; each set uses one of 64 locks.
template <class Value, std::size_t kSets>
class GuidTable {
  static_assert(kSets % 64 == 0);

 public:
  static constexpr std::size_t kCapacity = kSets * 8;

  // Returns use(value, fresh) with the entry of the GUID. fresh: the entry is new, and its value is
  // Value{}. pinned() is evaluated only for a new entry. Returns `full` if there is no place. now:
  // of any monotonic clock.
  template <class Pinned, class Use, class Result>
  Result with(const Guid& guid, std::int64_t now, Pinned pinned, Use use, Result full) {
    const std::size_t set = hash(guid) % kSets;
    const std::lock_guard lock(mutexes_[set % kMutexes]);
    Entry* const end = begin_of(set) + kWays;
    Entry* place = nullptr;
    for (Entry* entry = begin_of(set); entry != end; ++entry) {
      if (entry->taken && entry->guid == guid) {
        entry->used = now;
        return use(entry->value, false);
      }
      if (better(*entry, place))
        place = entry;
    }
    if (place == nullptr)
      return full;
    *place = Entry{guid, Value{}, now, true, pinned()};
    return use(place->value, true);
  }

  // Calls each(value) if the GUID has an entry. Does not count as a use of the entry.
  template <class Each>
  void find(const Guid& guid, Each each) {
    const std::size_t set = hash(guid) % kSets;
    const std::lock_guard lock(mutexes_[set % kMutexes]);
    for (Entry* entry = begin_of(set); entry != begin_of(set) + kWays; ++entry) {
      if (entry->taken && entry->guid == guid)
        return each(entry->value);
    }
  }

  // Pins the entries for which which(guid) is true.
  template <class Which>
  void pin(Which which) {
    each_entry([&](Entry& entry) { entry.pinned = entry.pinned || which(entry.guid); });
  }
  // Unpins the entries for which which(guid) is true, and calls each(value).
  template <class Which, class Each>
  void release(Which which, Each each) {
    each_entry([&](Entry& entry) {
      if (which(entry.guid)) {
        entry.pinned = false;
        each(entry.value);
      }
    });
  }
  template <class Which>
  void forget(Which which) {
    each_entry([&](Entry& entry) {
      if (which(entry.guid)) {
        entry.taken = false;
        entry.value = Value{};
      }
    });
  }

 private:
  static constexpr std::size_t kWays = 8;
  static constexpr std::size_t kMutexes = 64;

  struct Entry {
    Guid guid{};
    Value value{};
    std::int64_t used = 0;
    bool taken = false;
    bool pinned = false;
  };

  static bool better(const Entry& entry, const Entry* than) {
    if (than != nullptr && !than->taken)
      return false;
    if (!entry.taken)
      return true;
    return !entry.pinned && (than == nullptr || entry.used < than->used);
  }

  Entry* begin_of(std::size_t set) { return entries_.get() + set * kWays; }

  template <class Each>
  void each_entry(Each each) {
    for (std::size_t set = 0; set < kSets; ++set) {
      const std::lock_guard lock(mutexes_[set % kMutexes]);
      for (Entry* entry = begin_of(set); entry != begin_of(set) + kWays; ++entry) {
        if (entry->taken)
          each(*entry);
      }
    }
  }

  // FNV-1a from a random start that no sender can compute.
  std::size_t hash(const Guid& guid) const {
    std::uint64_t out = key_;
    for (const std::uint8_t octet : guid)
      out = (out ^ octet) * 0x100000001B3U;
    return static_cast<std::size_t>(out ^ out >> 32U);
  }

  static std::uint64_t random_key() {
    std::random_device random;
    return std::uint64_t{random()} << 32U | random();
  }

  const std::uint64_t key_ = random_key();
  std::unique_ptr<Entry[]> entries_ = std::make_unique<Entry[]>(kCapacity);
  std::array<std::mutex, kMutexes> mutexes_;
};

}  // namespace linegate::dds::guard
