// SPDX-License-Identifier: Apache-2.0
// The named topics of a gateway in another process, as its endpoints serve them: which topic has
// which number, and whether it has readers. See declared_topics.h.
//
// Used by the thread that writes samples, except report().
#pragma once

#include <algorithm>
#include <cstdint>
#include <deque>
#include <map>
#include <mutex>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "bridges/dds/port_codec.h"
#include "bridges/dds/sample_port.h"

namespace linegate::dds {

class ServedTopics {
 public:
  // port must outlive it.
  explicit ServedTopics(SamplePort& port) : port_(port) {}

  // Returns false if the topic could not be created.
  bool add(const NumberedTopic& topic) {
    if (!port_.add_named(topic.topic))
      return false;
    topics_[topic.number].name = topic.topic.topic;
    return true;
  }
  void remove(std::span<const std::uint32_t> numbers) {
    std::vector<std::string> ending;
    for (const std::uint32_t number : numbers) {
      if (const auto node = topics_.extract(number))
        ending.push_back(node.mapped().name);
    }
    if (!ending.empty())
      port_.remove_named(ending);
    const std::lock_guard lock(mutex_);
    for (const std::uint32_t number : numbers)
      changes_.erase(number);
  }
  // A topic without readers is not written: the gateway learns that it has none, and makes a new
  // sample when it has some. Returns false if the sample was refused.
  bool write(const NumberedSample& sample) {
    const auto topic = topics_.find(sample.topic);
    if (topic == topics_.end())
      return false;
    return !topic->second.has_readers || port_.write_named(topic->second.name, sample.sample);
  }
  // Returns true if there is something to report.
  bool look_at_readers() {
    bool any = false;
    for (auto& [number, topic] : topics_) {
      const bool present = port_.has_named_readers(topic.name);
      if (present == topic.has_readers)
        continue;
      topic.has_readers = present;
      any = true;
      const std::lock_guard lock(mutex_);
      changes_[number] = present;
    }
    return any;
  }

  // Calls send(message) for each change; what it refuses is reported with the next call. Returns
  // false if it refused one. From any thread.
  template <class Send>
  bool report(Send send) {
    const std::lock_guard lock(mutex_);
    PortMessage message;
    while (!changes_.empty()) {
      encode(NamedReadersMessage{changes_.begin()->first, changes_.begin()->second}, message);
      if (!send(message))
        return false;
      changes_.erase(changes_.begin());
    }
    return true;
  }

 private:
  struct Topic {
    std::string name;
    bool has_readers = false;
  };

  SamplePort& port_;
  std::map<std::uint32_t, Topic> topics_;
  std::mutex mutex_;
  std::map<std::uint32_t, bool> changes_;  // that were not reported
};

// The same for those that applications write. Used by the thread that receives samples.
class ServedSets {
 public:
  explicit ServedSets(SamplePort& port) : port_(port) {}

  // To be carried out by apply(), in the order of the calls. From any thread.
  void add(NumberedTopic topic) {
    const std::lock_guard lock(mutex_);
    steps_.push_back({.added = std::move(topic), .ended = {}});
  }
  void remove(std::vector<std::uint32_t> numbers) {
    const std::lock_guard lock(mutex_);
    steps_.push_back({.added = {}, .ended = std::move(numbers)});
  }
  // Carries out a few steps, because endpoints take time, and wakes the port if more are left.
  // Returns the number of topics that could not be created.
  std::uint64_t apply() {
    std::uint64_t failed = 0;
    for (int i = 0; i < kStepsOfCall; ++i) {
      const Step step = next_step();
      remove_now(step.ended);
      if (step.added.number == 0)
        continue;
      if (port_.add_named_reader(step.added.topic))
        numbers_[step.added.topic.topic] = step.added.number;
      else
        ++failed;
    }
    const std::lock_guard lock(mutex_);
    if (!steps_.empty())
      port_.wake();
    return failed;
  }
  // 0: there is no such topic.
  std::uint32_t number_of(const std::string& topic) const {
    const auto found = numbers_.find(topic);
    return found == numbers_.end() ? 0 : found->second;
  }

 private:
  struct Step {
    NumberedTopic added{};  // number 0: none
    std::vector<std::uint32_t> ended{};
  };
  static constexpr int kStepsOfCall = 8;

  Step next_step() {
    const std::lock_guard lock(mutex_);
    Step out;
    if (!steps_.empty()) {
      out = std::move(steps_.front());
      steps_.pop_front();
    }
    return out;
  }
  void remove_now(std::span<const std::uint32_t> numbers) {
    std::vector<std::string> ending;
    std::erase_if(numbers_, [&](const auto& known) {
      const bool ends = std::ranges::find(numbers, known.second) != numbers.end();
      if (ends)
        ending.push_back(known.first);
      return ends;
    });
    if (!ending.empty())
      port_.remove_named_readers(ending);
  }

  SamplePort& port_;
  std::map<std::string, std::uint32_t> numbers_;  // by topic
  std::mutex mutex_;
  std::deque<Step> steps_;
};

}  // namespace linegate::dds
