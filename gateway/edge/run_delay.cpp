// SPDX-License-Identifier: Apache-2.0
#include "gateway/edge/run_delay.h"

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <system_error>

namespace linegate::gateway {

// Documentation/scheduler/sched-stats.rst of the kernel: time on a processor, time in a run queue,
// both in ns, and the number of time slices.
std::map<std::string, Duration> RunDelay::delays() const {
  std::map<std::string, Duration> out;
  std::error_code gone;
  for (std::filesystem::directory_iterator task(tasks_, gone), end; !gone && task != end;
       task.increment(gone)) {
    std::ifstream file(task->path() / "schedstat");
    std::int64_t running = 0;
    std::int64_t waiting = 0;
    if (file >> running >> waiting) {
      out.emplace(task->path().filename().string(), Duration{waiting});
    }
  }
  return out;
}

Duration RunDelay::longest() const {
  Duration out{};
  for (const auto& [thread, delay] : delays()) {
    const auto before = before_.find(thread);
    out = std::max(out, before == before_.end() ? Duration{} : delay - before->second);
  }
  return out;
}

}  // namespace linegate::gateway
