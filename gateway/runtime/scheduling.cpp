// SPDX-License-Identifier: Apache-2.0
#include "gateway/runtime/scheduling.h"

#include <array>
#include <cerrno>
#include <cstring>

#include <linux/capability.h>
#include <pthread.h>
#include <sched.h>
#include <spdlog/spdlog.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <unistd.h>

namespace linegate::gateway {
namespace {

bool has_capability(unsigned number) {
  __user_cap_header_struct header{_LINUX_CAPABILITY_VERSION_3, 0};
  std::array<__user_cap_data_struct, _LINUX_CAPABILITY_U32S_3> data{};
  return syscall(SYS_capget, &header, data.data()) == 0 &&
         (data[number / 32].effective >> number % 32 & 1U) != 0;
}

// Returns 0 or errno. A limit that suffices now may be too low for later allocations: one that
// fails would end the gateway.
int lock_memory() {
  rlimit limit{};
  getrlimit(RLIMIT_MEMLOCK, &limit);
  if (limit.rlim_cur != RLIM_INFINITY && !has_capability(CAP_IPC_LOCK)) {
    return EPERM;
  }
  // MCL_ONFAULT, because the stacks of all threads are reserved with 8 MB each, of which little is
  // used.
  return mlockall(MCL_CURRENT | MCL_FUTURE | MCL_ONFAULT) == 0 ? 0 : errno;
}

int set_priority(int priority) {
  const sched_param parameter{priority};
  return pthread_setschedparam(pthread_self(), SCHED_FIFO, &parameter);
}

int set_processor(unsigned processor) {
  cpu_set_t set;
  CPU_ZERO(&set);
  CPU_SET(processor, &set);
  return pthread_setaffinity_np(pthread_self(), sizeof set, &set);
}

}  // namespace

void apply_scheduling(const config::ExecutorPlan& plan) {
  prctl(PR_SET_TIMERSLACK, 1UL, 0UL, 0UL, 0UL);
  const auto report = [&](const char* what, int error) {
    if (error != 0) {
      spdlog::warn("executor {}: {} is not permitted ({}); it runs without", plan.name, what,
                   std::strerror(error));
    }
  };
  if (plan.priority > 0) {
    report("real-time priority", set_priority(plan.priority));
  }
  if (plan.processor) {
    report("its processor", set_processor(*plan.processor));
  }
  if (plan.lock_memory) {
    report("locked memory", lock_memory());
  }
}

}  // namespace linegate::gateway
