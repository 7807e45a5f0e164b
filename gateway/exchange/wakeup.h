// SPDX-License-Identifier: Apache-2.0
// Wakes a thread that waits in poll or epoll.
#pragma once

#include <atomic>

namespace linegate::exchange {

// An eventfd. Any thread may signal; signals before the waiting thread has called clear() or
// clear_edge() cost only one system call together.
class Wakeup {
 public:
  // Throws std::system_error if no descriptor is available.
  Wakeup();
  ~Wakeup();
  Wakeup(const Wakeup&) = delete;
  Wakeup& operator=(const Wakeup&) = delete;

  // Readable after signal() until clear().
  int descriptor() const { return descriptor_; }

  // Data written to rings and hand-overs before this call is visible to the thread after its
  // clear().
  void signal();
  // Called by the waiting thread, before it reads its rings.
  void clear();
  // The same, without a system call, for a thread that waits in epoll with EPOLLET: the descriptor
  // stays readable, and the next signal() is a new edge.
  void clear_edge();

 private:
  int descriptor_;
  std::atomic<bool> pending_{false};
};

}  // namespace linegate::exchange
