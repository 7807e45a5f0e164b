// SPDX-License-Identifier: Apache-2.0
// The partitions of the remote writers of requests, by the GUID of the writer.
#pragma once

#include <cstddef>
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

  // A sample may have been written before its writer changed its partitions, so it cannot be
  // assigned to any. Such a writer has no partitions until it is removed.
  void note(const guard::Guid& writer, std::vector<std::string> partitions) {
    const std::lock_guard lock(mutex_);
    const auto known = writers_.find(writer);
    if (known != writers_.end()) {
      if (known->second != partitions)
        known->second.reset();
    } else if (writers_.size() < kMost) {
      writers_.emplace(writer, std::move(partitions));
    }
  }
  void forget(const guard::Guid& writer) {
    const std::lock_guard lock(mutex_);
    writers_.erase(writer);
  }

  // Nothing if the writer is not known, or changed its partitions.
  std::optional<std::vector<std::string>> of(const guard::Guid& writer) const {
    const std::lock_guard lock(mutex_);
    const auto known = writers_.find(writer);
    return known == writers_.end() ? std::nullopt : known->second;
  }

 private:
  mutable std::mutex mutex_;
  std::map<guard::Guid, std::optional<std::vector<std::string>>> writers_;
};

}  // namespace linegate::dds
