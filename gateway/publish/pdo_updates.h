// SPDX-License-Identifier: Apache-2.0
// Selects the PDOs of a line that are published as PdoUpdate, and when.
#pragma once

#include <cstdint>
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
    }
    waiting_.resize(kept);
    return next;
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
};

}  // namespace linegate::gateway
