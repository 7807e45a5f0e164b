// SPDX-License-Identifier: Apache-2.0
// Records the participants and endpoints of a domain, as they announce themselves. Bounded, because
// any host can invent them.
#pragma once

#include <algorithm>
#include <cstddef>
#include <map>
#include <mutex>
#include <utility>
#include <vector>

#include "bridges/dds/observed.h"

namespace linegate::dds {

// From any thread.
class DiscoveryRecord {
 public:
  static constexpr std::size_t kMostRecorded = 8192;

  void add(ObservedParticipant it) {
    const std::lock_guard lock(mutex_);
    const bool refused = it.refused;
    const auto known = participants_.find(it.prefix);
    if (known == participants_.end() && participants_.size() >= kMostRecorded)
      return;
    ObservedParticipant& entry = participants_[it.prefix];
    const bool was_refused = entry.refused;
    if (!it.name.empty() || entry.name.empty())
      entry = std::move(it);
    entry.refused = refused || was_refused;
  }
  // The result of an authentication.
  void authenticated(const ObservedPrefix& prefix, bool accepted) {
    const std::lock_guard lock(mutex_);
    if (participants_.size() >= kMostRecorded && !participants_.contains(prefix))
      return;
    ObservedParticipant& entry = participants_[prefix];
    entry.prefix = prefix;
    entry.refused = !accepted;
  }
  void remove(const ObservedPrefix& prefix) {
    const std::lock_guard lock(mutex_);
    participants_.erase(prefix);
    std::erase_if(endpoints_, [&](const auto& it) {
      return std::equal(prefix.begin(), prefix.end(), it.first.begin());
    });
  }
  void add(ObservedEndpoint it) {
    const std::lock_guard lock(mutex_);
    if (endpoints_.size() < kMostRecorded || endpoints_.contains(it.guid)) {
      const ObservedGuid guid = it.guid;
      endpoints_.insert_or_assign(guid, std::move(it));
    }
  }
  void remove(const ObservedGuid& guid) {
    const std::lock_guard lock(mutex_);
    endpoints_.erase(guid);
  }

  std::vector<ObservedParticipant> participants() const { return values(participants_); }
  std::vector<ObservedEndpoint> endpoints() const { return values(endpoints_); }

 private:
  template <class Key, class Value>
  std::vector<Value> values(const std::map<Key, Value>& all) const {
    const std::lock_guard lock(mutex_);
    std::vector<Value> out;
    for (const auto& [key, value] : all)
      out.push_back(value);
    return out;
  }

  mutable std::mutex mutex_;
  std::map<ObservedPrefix, ObservedParticipant> participants_;
  std::map<ObservedGuid, ObservedEndpoint> endpoints_;
};

}  // namespace linegate::dds
