// SPDX-License-Identifier: Apache-2.0
#include "gateway/process/progress_watch.h"

#include <algorithm>
#include <utility>

namespace linegate::gateway {

ProgressWatch::ProgressWatch(std::vector<WatchedThread> threads) {
  for (auto& thread : threads) {
    threads_.push_back({std::move(thread), 0});
  }
}

bool ProgressWatch::all_started() const {
  return std::all_of(threads_.begin(), threads_.end(),
                     [](const Watched& watched) { return watched.thread.rounds->value() != 0; });
}

std::vector<std::string> ProgressWatch::look() {
  std::vector<std::string> stuck;
  for (Watched& watched : threads_) {
    const std::uint64_t rounds = watched.thread.rounds->value();
    if (asked_ && rounds == watched.seen) {
      stuck.push_back(watched.thread.name);
    }
    watched.seen = rounds;
    watched.thread.ask();
  }
  asked_ = true;
  return stuck;
}

}  // namespace linegate::gateway
