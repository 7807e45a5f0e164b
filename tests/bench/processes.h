// SPDX-License-Identifier: Apache-2.0
// The processes of a measurement, and their processor time.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include <sys/types.h>

namespace linegate::bench {

// Starts a process that ends with its parent at the latest. run() does not return in a good case.
pid_t start_process(const std::function<void()>& run);
// Starts this program again, with these arguments.
pid_t start_again(const std::vector<std::string>& arguments);
// Kills it.
void end_process(pid_t process);

// The process and its children.
std::vector<pid_t> processes_of(pid_t process);

// Of one process, in us.
double processor_time(pid_t process);
// Of the process and its children, but for `without`, in us.
double processor_time_of_all(pid_t process, pid_t without = -1);

}  // namespace linegate::bench
