// SPDX-License-Identifier: Apache-2.0
// Wakes a thread that waits in epoll at a given time.
#pragma once

#include "stack/base/time.h"

namespace linegate::gateway {

// A timerfd, set only if a deadline is earlier than its present one. A time-out of the wait itself
// would be set and cancelled for every frame. Where a hypervisor owns the processor's timer, this
// costs more than the frame.
class DeadlineTimer {
 public:
  // Throws std::system_error if no descriptor is available.
  DeadlineTimer();
  ~DeadlineTimer();
  DeadlineTimer(const DeadlineTimer&) = delete;
  DeadlineTimer& operator=(const DeadlineTimer&) = delete;

  // Readable from the deadline on, until the next wake_at() with a later deadline.
  int descriptor() const { return descriptor_; }

  // Precondition: until is after now. The timer may wake earlier, for a previous deadline.
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
