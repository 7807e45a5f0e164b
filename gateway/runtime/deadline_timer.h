// SPDX-License-Identifier: Apache-2.0
// Wakes a thread that waits in epoll at an instant.
#pragma once

#include "stack/base/time.h"

namespace linegate::gateway {

// A timerfd, set only when a deadline comes earlier than what it is set to. A time-out of the wait
// itself would be set and taken back with every frame, which costs more than the frame where a
// processor's timer belongs to a hypervisor.
class DeadlineTimer {
 public:
  // Throws std::system_error if the system has no descriptor left.
  DeadlineTimer();
  ~DeadlineTimer();
  DeadlineTimer(const DeadlineTimer&) = delete;
  DeadlineTimer& operator=(const DeadlineTimer&) = delete;

  // Readable from the deadline on, until the next wake_at() with a deadline to come.
  int descriptor() const { return descriptor_; }

  // until: after now. The timer may wake earlier, for a deadline that was given before.
  void wake_at(Instant until, Instant now) {
    if (set_to_ <= now || until < set_to_) {
      set(until);
    }
  }

 private:
  void set(Instant until);

  int descriptor_;
  Instant set_to_{};
};

}  // namespace linegate::gateway
