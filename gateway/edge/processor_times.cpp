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
ProcessorTimes::Sample ProcessorTimes::read() const {
  Sample out;
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

ProcessorUse use_between(const ProcessorTimes::Sample& before, const ProcessorTimes::Sample& after,
                         int thread) {
  ProcessorUse out;
  for (const auto& [number, times] : after) {
    const auto then = before.find(number);
    if (then == before.end()) {
      continue;
    }
    out.waiting_of_all += times.waiting - then->second.waiting;
    if (number == thread) {
      out.running = times.running - then->second.running;
      out.waiting = times.waiting - then->second.waiting;
    }
  }
  return out;
}

}  // namespace linegate::gateway
