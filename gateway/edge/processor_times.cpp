// SPDX-License-Identifier: Apache-2.0
#include "gateway/edge/processor_times.h"

#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <system_error>

namespace linegate::gateway {

// Documentation/scheduler/sched-stats.rst of the kernel: time on a processor, time in a run queue,
// both in ns, and the number of time slices.
std::map<int, ProcessorTimes::Thread> ProcessorTimes::read() const {
  std::map<int, Thread> out;
  std::error_code gone;
  for (std::filesystem::directory_iterator task(tasks_, gone), end; !gone && task != end;
       task.increment(gone)) {
    std::ifstream file(task->path() / "schedstat");
    std::int64_t running = 0;
    std::int64_t waiting = 0;
    if (file >> running >> waiting) {
      out.emplace(std::atoi(task->path().filename().c_str()),
                  Thread{Duration{running}, Duration{waiting}});
    }
  }
  return out;
}

ProcessorTimes::Times ProcessorTimes::since_begin(int thread) const {
  Times out;
  for (const auto& [number, times] : read()) {
    const auto before = before_.find(number);
    if (before == before_.end()) {
      continue;
    }
    out.waiting_of_all += times.waiting - before->second.waiting;
    if (number == thread) {
      out.running = times.running - before->second.running;
      out.waiting = times.waiting - before->second.waiting;
    }
  }
  return out;
}

}  // namespace linegate::gateway
