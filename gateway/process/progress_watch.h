// SPDX-License-Identifier: Apache-2.0
// Whether the gateway's threads still go round.
//
// A thread that waits is asked to go round once; one that then does not is stuck: in a call that
// does not come back, in a lock, in a loop, or because it is not given processor time.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "gateway/exchange/cell.h"

namespace linegate::gateway {

struct WatchedThread {
  std::string name;  // as the system calls it: "exec press", "publisher"
  const exchange::Counter* rounds = nullptr;
  std::function<void()> ask;  // makes it go round when it waits
};

class ProgressWatch {
 public:
  // What the threads hold must outlive the watch.
  explicit ProgressWatch(std::vector<WatchedThread> threads);

  // Each thread has ended a round since it began to run.
  bool all_started() const;

  // Gives the names of those that have ended no round since the last look, and asks all for one
  // until the next. The first look finds nobody.
  std::vector<std::string> look();

 private:
  struct Watched {
    WatchedThread thread;
    std::uint64_t seen = 0;
  };
  std::vector<Watched> threads_;
  bool asked_ = false;
};

}  // namespace linegate::gateway
