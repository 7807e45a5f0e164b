// SPDX-License-Identifier: Apache-2.0
#include "gateway/edge/system_calls.h"

#include <array>
#include <cerrno>
#include <csignal>
#include <cstdint>

#include <fcntl.h>
#include <gtest/gtest.h>
#include <linux/sockios.h>
#include <sched.h>
#include <sys/ioctl.h>
#include <sys/prctl.h>
#include <sys/ptrace.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

namespace linegate::gateway {
namespace {

bool refused(long result) {
  return result == -1 && errno == EPERM;
}

// Attempts of a process of the same user against its parent. Returns the number of the first that
// succeeded, 0 if none.
int attack(pid_t victim) {
  const rlimit none{0, 0};
  const sched_param lowest{};
  std::array<char*, 1> arguments{};
  // Process 0 is the caller for some calls, and all of its group for kill().
  const f_owner_ex owner{F_OWNER_PID, victim};
  const std::array attempts{
      refused(fcntl(STDERR_FILENO, F_SETOWN, victim)),
      refused(fcntl(STDERR_FILENO, F_SETOWN_EX, &owner)),
      refused(fcntl(STDERR_FILENO, F_SETSIG, SIGKILL)),
      refused(ioctl(STDERR_FILENO, FIOSETOWN, &victim)),
      refused(ioctl(STDERR_FILENO, SIOCSPGRP, &victim)),
      refused(kill(victim, 0)),
      refused(kill(0, 0)),
      refused(kill(-1, 0)),
      refused(syscall(SYS_kill, (std::uint64_t{1} << 32U) + static_cast<std::uint64_t>(victim), 0)),
      refused(syscall(SYS_tgkill, victim, victim, 0)),
      refused(syscall(SYS_tkill, victim, 0)),
      refused(syscall(SYS_pidfd_open, victim, 0)),
      refused(ptrace(PTRACE_SEIZE, victim, nullptr, nullptr)),
      refused(syscall(SYS_process_vm_readv, victim, nullptr, 0, nullptr, 0, 0)),
      refused(syscall(SYS_prlimit64, victim, RLIMIT_NOFILE, &none, nullptr)),
      refused(sched_setscheduler(victim, SCHED_IDLE, &lowest)),
      refused(setpriority(PRIO_PROCESS, static_cast<id_t>(victim), 19)),
      refused(execve("/bin/true", arguments.data(), arguments.data()))};
  for (std::size_t i = 0; i < attempts.size(); ++i) {
    if (!attempts[i]) {
      return static_cast<int>(i) + 1;
    }
  }
  return 0;
}

// Returns the exit code of the function in a child of this process.
template <class Function>
int in_child(Function function) {
  const pid_t child = fork();
  if (child == 0) {
    const bool ready = prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) == 0 && protect_other_processes();
    _exit(ready ? function() : 100);
  }
  int status = 0;
  waitpid(child, &status, 0);
  return WIFEXITED(status) ? WEXITSTATUS(status) : 200 + WTERMSIG(status);
}

TEST(SystemCalls, AnotherProcessCannotBeAffected) {
  EXPECT_EQ(in_child([] { return attack(getppid()); }), 0) << "number of the attempt";
}

TEST(SystemCalls, TheProcessMayAffectItself) {
  EXPECT_EQ(in_child([] {
              rlimit limit{};
              return kill(getpid(), 0) == 0 && getrlimit(RLIMIT_NOFILE, &limit) == 0 &&
                             setrlimit(RLIMIT_NOFILE, &limit) == 0
                         ? 0
                         : 1;
            }),
            0);
  EXPECT_EQ(in_child([]() -> int {
              signal(SIGABRT, SIG_DFL);
              raise(SIGABRT);
              return 0;
            }),
            200 + SIGABRT);
}

}  // namespace
}  // namespace linegate::gateway
