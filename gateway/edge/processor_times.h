// SPDX-License-Identifier: Apache-2.0
// How long the threads of this process had a processor, and how long they waited for one.
#pragma once

#include <map>
#include <string>
#include <utility>

#include "stack/base/time.h"

namespace linegate::gateway {

// All figures are 0 if the kernel does not report them (schedstat of each thread:
// CONFIG_SCHED_INFO). Threads that started after begin() do not count.
class ProcessorTimes {
 public:
  explicit ProcessorTimes(std::string tasks = "/proc/self/task") : tasks_(std::move(tasks)) {}

  // Starts to count.
  void begin() { before_ = read(); }
  struct Times {
    Duration running{};         // of the thread
    Duration waiting{};         // of the thread
    Duration waiting_of_all{};  // of all threads, added up
  };
  // Since begin(). thread: as gettid(2).
  Times since_begin(int thread) const;

 private:
  struct Thread {
    Duration running{};
    Duration waiting{};
  };
  std::map<int, Thread> read() const;

  std::string tasks_;
  std::map<int, Thread> before_;
};

}  // namespace linegate::gateway
