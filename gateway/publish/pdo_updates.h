// SPDX-License-Identifier: Apache-2.0
// Selects the PDOs of a line that are published as PdoUpdate, and when.
#pragma once

#include <cstdint>
#include <deque>
#include <limits>
#include <vector>

#include "stack/base/time.h"
#include "stack/image/snapshot.h"

namespace linegate::gateway {

// Collects the receptions in snapshots and publishes each PDO at most once in min_period. A PDO
// that is not due is published later, with the number of receptions that it represents.
class PdoUpdates {
 public:
  explicit PdoUpdates(Duration min_period) : min_period_(min_period) {}

  void add(const image::Snapshot& snapshot);

  // Calls publish(mark, receptions) for each PDO that is due, with the values of the snapshot that
  // was added last. Returns when the next one is due; kNever if none is waiting.
  template <class Publish>
  Instant publish_due(Instant now, Publish&& publish) {
    next_look(now);
    Instant next = kNever;
    std::size_t kept = 0;
    for (const std::size_t i : waiting_) {
      Pdo& pdo = pdos_[i];
      if (pdo.published && now < pdo.last + min_period_) {
        next = earlier(next, pdo.last + min_period_);
        waiting_[kept++] = i;
        continue;
      }
      publish(pdo.mark, pdo.receptions);
      pdo.receptions = 0;
      pdo.published = true;
      pdo.last = now;
      if (looks_.empty() || looks_.back() != now + min_period_) {
        looks_.push_back(now + min_period_);
      }
    }
    waiting_.resize(kept);
    return next;
  }

  // When receptions of a PDO that was published become due, whether there are any or not; kNever:
  // of all others, each reception is due. For lines that report only those that are due
  // (UpdateWakes).
  Instant next_look(Instant now) {
    while (!looks_.empty() && looks_.front() <= now) {
      looks_.pop_front();
    }
    return looks_.empty() ? kNever : looks_.front();
  }

 private:
  static constexpr std::size_t kNone = std::numeric_limits<std::size_t>::max();
  struct Pdo {
    image::PdoMark mark;           // of the last reception
    std::uint32_t receptions = 0;  // since the last sample; 0 = not waiting
    bool published = false;
    Instant last{};
  };

  Duration min_period_;
  std::vector<Pdo> pdos_;
  std::vector<std::size_t> by_local_pdo_;
  std::vector<std::size_t> waiting_;
  std::deque<Instant> looks_;  // in the order of time
};

}  // namespace linegate::gateway
