// SPDX-License-Identifier: Apache-2.0
// The named topics whose endpoints are in another process: their numbers in the messages
// (port_codec.h), and which of them have readers.
//
// A number belongs to one topic with one type, and is never used again. So a message that is late
// is of a topic that no longer exists, and never of one with the same name and another type.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <string_view>

#include "bridges/dds/named_topic.h"

namespace linegate::dds {

class DeclaredTopics {
 public:
  struct Declared {
    std::uint32_t number = 0;
    std::string line;
    std::string topic;
    std::size_t max_size = 0;
  };

  // Returns its number: 1, 2, 3, ...
  std::uint32_t add(const NamedTopic& topic) {
    Entry& entry = topics_[topic.topic];
    numbers_.erase(entry.declared.number);
    entry = {.declared = {++last_, topic.line, topic.topic, topic.max_size}};
    numbers_[last_] = &entry;
    return last_;
  }
  // Returns its number; 0: there is no such topic.
  std::uint32_t remove(std::string_view topic) {
    const auto found = topics_.find(topic);
    if (found == topics_.end())
      return 0;
    const std::uint32_t number = found->second.declared.number;
    numbers_.erase(number);
    topics_.erase(found);
    return number;
  }
  // nullptr: there is no such topic.
  const Declared* find(std::string_view topic) const {
    const auto found = topics_.find(topic);
    return found == topics_.end() ? nullptr : &found->second.declared;
  }
  const Declared* find(std::uint32_t number) const {
    const auto found = numbers_.find(number);
    return found == numbers_.end() ? nullptr : &found->second->declared;
  }
  // Whether it is or was the number of a topic.
  bool was_given(std::uint32_t number) const { return number != 0 && number <= last_; }

  // The process reports that the topic has readers now, or none. Each report of readers means that
  // it had none at some time before, after which it has dropped samples.
  void note_readers(std::uint32_t number, bool present) {
    if (const auto found = numbers_.find(number); found != numbers_.end())
      found->second->came = present ? ++comings_ : 0;
  }
  // Another process runs: it has not reported any.
  void forget_readers() {
    for (auto& [topic, entry] : topics_)
      entry.came = 0;
  }
  // Whether the topic has readers. After they have left and others have come it returns false once,
  // with `again` set, and true from the next call on.
  bool has_readers(std::string_view topic, bool& again) {
    again = false;
    const auto found = topics_.find(topic);
    if (found == topics_.end())
      return false;
    Entry& entry = found->second;
    again = entry.came != entry.seen && entry.came != 0 && entry.seen != 0;
    entry.seen = again ? 0 : entry.came;
    return entry.seen != 0;
  }

 private:
  struct Entry {
    Declared declared{};
    std::uint64_t came = 0;  // number of the report of its readers; 0: it has none
    std::uint64_t seen = 0;  // the same when has_readers() was called last
  };

  std::map<std::string, Entry, std::less<>> topics_;  // its nodes do not move
  std::map<std::uint32_t, Entry*> numbers_;
  std::uint32_t last_ = 0;
  std::uint64_t comings_ = 0;
};

}  // namespace linegate::dds
