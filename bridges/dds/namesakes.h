// SPDX-License-Identifier: Apache-2.0
// Others that have the name of this participant: two gateways of one name, which no subscriber can
// tell apart.
#pragma once

#include <cstddef>
#include <map>

#include "stack/base/time.h"

namespace linegate::dds {

template <class Key>
class Namesakes {
 public:
  // One of them was discovered. lease: how long it may be silent before it counts as gone, >= 0.
  void come(const Key& key, Instant now, Duration lease) {
    alive_.try_emplace(key, deadline(now, lease));
  }
  void go(const Key& key) { alive_.erase(key); }

  // Those that are there for longer than their lease. Before that it may be one that was killed, of
  // which a discovery server still tells: this gateway itself, before it was started again.
  std::size_t count(Instant now) const {
    std::size_t out = 0;
    for (const auto& [key, since] : alive_) {
      out += since <= now ? 1U : 0U;
    }
    return out;
  }

 private:
  std::map<Key, Instant> alive_;  // since when that is certain
};

}  // namespace linegate::dds
