// SPDX-License-Identifier: Apache-2.0
// How long the threads of this process had a processor, and how long they waited for one.
#pragma once

#include <map>
#include <string>
#include <utility>

#include "stack/base/time.h"

namespace linegate::gateway {

// All figures are 0 if the kernel does not report them (schedstat of each thread:
// CONFIG_SCHED_INFO).
class ProcessorTimes {
 public:
  explicit ProcessorTimes(std::string tasks = "/proc/self/task") : tasks_(std::move(tasks)) {}

  struct Thread {
    Duration running{};
    Duration waiting{};
  };
  // Since the start of each thread, by its number as gettid(2).
  using Sample = std::map<int, Thread>;
  Sample read() const;

 private:
  std::string tasks_;
};

// Between two samples. Threads that are in one of them only do not count.
struct ProcessorUse {
  Duration running{};         // of the thread
  Duration waiting{};         // of the thread
  Duration waiting_of_all{};  // of all threads, added up
};
ProcessorUse use_between(const ProcessorTimes::Sample& before, const ProcessorTimes::Sample& after,
                         int thread);

}  // namespace linegate::gateway
