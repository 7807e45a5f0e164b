// SPDX-License-Identifier: Apache-2.0
// Counts the system calls of the calling thread: a program that links thread_counts.cpp calls
// recvmmsg, send, sendmmsg, epoll_wait, epoll_pwait2, timerfd_settime, read and write through it.
// (Reading a clock needs no system call.)
#pragma once

#include <cstdint>

namespace linegate::bench {

struct ThreadCounts {
  std::uint64_t system_calls = 0;
  std::uint64_t waits = 0;  // system calls that may sleep: each return is a wake-up
};

ThreadCounts& thread_counts();

}  // namespace linegate::bench
