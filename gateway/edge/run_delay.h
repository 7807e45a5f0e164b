// SPDX-License-Identifier: Apache-2.0
// How long the threads of this process were ready to run and had no processor.
#pragma once

#include <map>
#include <string>
#include <utility>

#include "stack/base/time.h"

namespace linegate::gateway {

class RunDelay {
 public:
  explicit RunDelay(std::string tasks = "/proc/self/task") : tasks_(std::move(tasks)) {}

  // Starts to count.
  void begin() { before_ = delays(); }
  // Of the thread that has waited longest for a processor since begin(). 0 if the kernel does not
  // report it (schedstat of each thread: CONFIG_SCHED_INFO).
  Duration longest() const;

 private:
  std::map<std::string, Duration> delays() const;  // by thread

  std::string tasks_;
  std::map<std::string, Duration> before_;
};

}  // namespace linegate::gateway
