// SPDX-License-Identifier: Apache-2.0
// Other participants with the name of this one: subscribers cannot distinguish two gateways of the
// same name.
#pragma once

#include <cstddef>
#include <map>

#include "stack/base/time.h"

namespace linegate::dds {

template <class Key>
class Namesakes {
 public:
  // A participant with this name was discovered. lease: its lease duration, >= 0; it may be silent
  // for that long before it counts as gone.
  void come(const Key& key, Instant now, Duration lease) {
    alive_.try_emplace(key, deadline(now, lease));
  }
  void go(const Key& key) { alive_.erase(key); }

  // Number of participants that have existed longer than their lease. Before that it may be a
  // killed one that a discovery server still announces, such as an earlier start of this gateway.
  std::size_t count(Instant now) const {
    std::size_t out = 0;
    for (const auto& [key, since] : alive_) {
      out += since <= now ? 1U : 0U;
    }
    return out;
  }

 private:
  std::map<Key, Instant> alive_;  // the time from which the participant counts
};

}  // namespace linegate::dds
