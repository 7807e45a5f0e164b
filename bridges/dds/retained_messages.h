// SPDX-License-Identifier: Apache-2.0
// The messages that a new process for the DDS endpoints must receive, and those that wait for room.
//
// All are kept in the order in which they were added. A message that replaces another one moves to
// the end; so a process that is slow or absent receives the newest states, and the memory is
// bounded by the number of keys and their depths.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <iterator>
#include <list>
#include <map>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

namespace linegate::dds {

class RetainedMessages {
 public:
  using Message = std::vector<std::byte>;

  struct Key {
    std::string line;
    std::uint8_t topic = 0;
    std::string instance{};

    friend auto operator<=>(const Key&, const Key&) = default;
  };
  struct Policy {
    std::size_t depth = 1;  // messages of a key
    // Carried out once is enough: a new process receives only those that were not.
    bool once = false;
    // With once: except the newest one, which each process receives.
    bool newest_always = false;
    // With once: no other message has the key, which is forgotten when it was carried out.
    bool only = false;
  };

  // The message is swapped with the buffer of an earlier one. tally: see unsent_tally().
  void add(const Key& key, Policy policy, Message& message, std::uint32_t tally = 0) {
    const auto place = slots_.try_emplace(key).first;
    Slot& slot = place->second;
    slot.key = &place->first;
    if (slot.entries.size() >= policy.depth) {
      lost_ += policy.depth > 1 && !slot.entries.front()->sent ? 1U : 0U;
      erase(slot.entries.front());
      slot.entries.pop_front();
    }
    if (spare_.empty())
      spare_.emplace_back();
    spare_.front().message.clear();
    entries_.splice(entries_.end(), spare_, spare_.begin());
    Entry& entry = entries_.back();
    entry.message.swap(message);
    entry.slot = &slot;
    entry.policy = policy;
    entry.sent = entry.done = false;
    entry.tally = tally;
    slot.entries.push_back(std::prev(entries_.end()));
    if (next_ == entries_.end())
      next_ = std::prev(entries_.end());
  }

  bool contains(const Key& key) const {
    const auto found = slots_.find(key);
    return found != slots_.end() && !found->second.entries.empty();
  }
  // Messages of the key that were not carried out.
  std::size_t pending(const Key& key) const {
    std::size_t count = 0;
    if (const auto found = slots_.find(key); found != slots_.end()) {
      for (const auto& entry : found->second.entries)
        count += entry->done ? 0U : 1U;
    }
    return count;
  }
  // The tally of the newest message of the key if it was not sent, else 0.
  std::uint32_t unsent_tally(const Key& key) const {
    const auto found = slots_.find(key);
    if (found == slots_.end() || found->second.entries.empty())
      return 0;
    const Entry& entry = *found->second.entries.back();
    return entry.sent ? 0 : entry.tally;
  }

  // Drops all messages for which wanted(key) is true.
  template <class Wanted>
  void drop(Wanted wanted) {
    for (auto slot = slots_.begin(); slot != slots_.end();) {
      if (!wanted(slot->first)) {
        ++slot;
        continue;
      }
      for (const auto& entry : slot->second.entries)
        erase(entry);
      slot = slots_.erase(slot);
    }
  }

  // The next message to send; nullptr if there is none.
  const Message* next() const { return next_ == entries_.end() ? nullptr : &next_->message; }
  // next() was sent; `end` is the position behind it.
  void note_sent(std::uint64_t end) {
    next_->sent = true;
    next_->end = end;
    if (next_->policy.once)
      under_way_.push_back(next_);
    ++next_;
  }
  // The process has carried out all messages up to that position.
  void note_done(std::uint64_t position) {
    while (!under_way_.empty() && under_way_.front()->end <= position) {
      const auto entry = under_way_.front();
      under_way_.pop_front();
      entry->done = true;
      const bool is_only = entry->policy.only;
      Slot& slot = *entry->slot;
      drop_done(slot);
      if (is_only && slot.entries.empty())
        slots_.erase(slots_.find(*slot.key));
    }
  }
  // Another process runs: all messages are sent again, from the oldest one.
  void restart() {
    under_way_.clear();
    for (Entry& entry : entries_)
      entry.sent = entry.done = false;
    next_ = entries_.begin();
  }

  std::size_t size() const { return entries_.size(); }
  // Keys whose room is kept.
  std::size_t keys() const { return slots_.size(); }
  // Messages that were never sent, because too many of their key followed. Those that were only
  // replaced by a newer state are not counted.
  std::uint64_t lost() const { return lost_; }

 private:
  struct Slot;
  struct Entry {
    Message message;
    Slot* slot = nullptr;
    Policy policy;
    bool sent = false;
    bool done = false;      // of those that are sent once
    std::uint64_t end = 0;  // valid if sent
    std::uint32_t tally = 0;
  };
  using Place = typename std::list<Entry>::iterator;
  struct Slot {
    std::deque<Place> entries;  // oldest first
    const Key* key = nullptr;   // its own
  };
  static constexpr std::size_t kSpare = 32;

  void drop_done(Slot& slot) {
    const std::size_t kept = slot.entries.front()->policy.newest_always ? 1 : 0;
    while (slot.entries.size() > kept && slot.entries.front()->done) {
      erase(slot.entries.front());
      slot.entries.pop_front();
    }
  }
  void erase(Place place) {
    if (place == next_)
      ++next_;
    if (place->sent && !place->done && place->policy.once)
      std::erase(under_way_, place);
    spare_.splice(spare_.begin(), entries_, place);
    if (spare_.size() > kSpare)
      spare_.pop_back();
  }

  std::list<Entry> entries_;     // in the order in which they are sent
  Place next_ = entries_.end();  // the first that was not sent
  std::deque<Place> under_way_;  // sent, to be carried out once
  std::list<Entry> spare_;       // their buffers are reused
  std::map<Key, Slot> slots_;    // its nodes do not move
  std::uint64_t lost_ = 0;
};

}  // namespace linegate::dds
