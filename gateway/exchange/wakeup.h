// SPDX-License-Identifier: Apache-2.0
// Wakes a thread that waits in poll or epoll.
#pragma once

#include <atomic>

namespace linegate::exchange {

// An eventfd. Any thread may signal; many signals before the waiter has looked cost one system
// call.
class Wakeup {
 public:
  // Throws std::system_error if the system has no descriptor left.
  Wakeup();
  ~Wakeup();
  Wakeup(const Wakeup&) = delete;
  Wakeup& operator=(const Wakeup&) = delete;

  // Readable after signal() until clear().
  int descriptor() const { return descriptor_; }

  // What was written to rings and hand-overs before is seen by the thread after its clear().
  void signal();
  // By the waiting thread, before it looks into its rings.
  void clear();

 private:
  int descriptor_;
  std::atomic<bool> pending_{false};
};

}  // namespace linegate::exchange
