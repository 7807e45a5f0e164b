// SPDX-License-Identifier: Apache-2.0
// The partitions of the remote writers of requests, by the GUID of the writer.
#pragma once

#include <cstddef>
#include <deque>
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "bridges/dds/guard/wire.h"

namespace linegate::dds {

// Thread-safe.
class WriterPartitions {
 public:
  // Bounded: a participant may announce any number of writers. Those beyond it have no partitions.
  static constexpr std::size_t kMost = 4'096;
  // A sample may be read after its writer has gone: the last ones remain.
  static constexpr std::size_t kMostGone = 256;

  // A sample may have been written before its writer changed its partitions, so it cannot be
  // assigned to any. Such a writer has no partitions until it is removed.
  void note(const guard::Guid& writer, std::vector<std::string> partitions) {
    const std::lock_guard lock(mutex_);
    const auto known = writers_.find(writer);
    if (known != writers_.end() && !known->second.gone) {
      if (known->second.partitions != partitions)
        known->second.partitions.reset();
    } else if (known != writers_.end() || writers_.size() < kMost) {
      writers_[writer] = {.partitions = std::move(partitions)};
    }
  }
  void forget(const guard::Guid& writer) {
    const std::lock_guard lock(mutex_);
    const auto known = writers_.find(writer);
    if (known == writers_.end() || known->second.gone)
      return;
    known->second.gone = true;
    gone_.push_back(writer);
    if (gone_.size() > kMostGone)
      remove_oldest();
  }

  // Nothing if the writer is not known, or changed its partitions.
  std::optional<std::vector<std::string>> of(const guard::Guid& writer) const {
    const std::lock_guard lock(mutex_);
    const auto known = writers_.find(writer);
    return known == writers_.end() ? std::nullopt : known->second.partitions;
  }

 private:
  struct Writer {
    std::optional<std::vector<std::string>> partitions;
    bool gone = false;
  };

  void remove_oldest() {
    const auto oldest = writers_.find(gone_.front());
    gone_.pop_front();
    if (oldest != writers_.end() && oldest->second.gone)
      writers_.erase(oldest);
  }

  mutable std::mutex mutex_;
  std::map<guard::Guid, Writer> writers_;
  std::deque<guard::Guid> gone_;  // in this order; one that came back may be among them
};

}  // namespace linegate::dds
