// SPDX-License-Identifier: Apache-2.0
// How long a thread of a library has stalled, without the time for which this process waited for
// processors.
#pragma once

#include <deque>
#include <string>
#include <utility>

#include "gateway/edge/processor_times.h"
#include "stack/base/time.h"

namespace linegate::gateway {

// A thread that did not sleep in the time loops. One that slept is blocked, or only late, because
// it needs a lock of a thread that waits for a processor: on an overloaded machine the time in
// which threads of this process wait for one does not count.
class StallTime {
 public:
  // Shorter stalls are not observed.
  static constexpr Duration kObserved = std::chrono::milliseconds(50);

  explicit StallTime(std::string tasks = "/proc/self/task") : times_(std::move(tasks)) {}

  // Returns the part of the longest stall of all threads that counts. Call it several times a
  // second, because a stall that is not the longest may become the longest later: what was observed
  // since the first one belongs to it, too. thread: as gettid(2).
  Duration count(int thread, Duration stall, Instant now);

 private:
  struct Observed {
    Instant at;
    ProcessorTimes::Sample sample;
  };
  static constexpr std::size_t kMostObserved = 128;

  ProcessorTimes times_;
  std::deque<Observed> observed_;  // since a stall of kObserved; the first one is kept longest
};

}  // namespace linegate::gateway
