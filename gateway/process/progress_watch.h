// SPDX-License-Identifier: Apache-2.0
// Checks whether the gateway's threads respond.
//
// A waiting thread is asked for one round. A thread that then does not complete a round is stuck:
// in a call that does not return, in a lock, in a loop, or without processor time.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "gateway/exchange/cell.h"

namespace linegate::gateway {

struct WatchedThread {
  std::string name;  // thread name in the system: "exec press", "publisher"
  const exchange::Counter* rounds = nullptr;
  std::function<void()> ask;  // makes the thread do a round if it waits
};

class ProgressWatch {
 public:
  // The objects that the threads refer to must outlive the watch.
  explicit ProgressWatch(std::vector<WatchedThread> threads);

  // Whether each thread has completed a round since it started.
  bool all_started() const;

  // Returns the names of the threads that have not completed a round since the last call, and
  // requests one from all of them until the next call. The first call returns none.
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
