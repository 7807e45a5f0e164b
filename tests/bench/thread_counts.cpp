// SPDX-License-Identifier: Apache-2.0
#include "tests/bench/thread_counts.h"

#include <cstddef>

#include <sys/epoll.h>
#include <sys/socket.h>
#include <sys/syscall.h>
#include <sys/timerfd.h>
#include <unistd.h>

namespace {

thread_local linegate::bench::ThreadCounts counts;

constexpr std::size_t kSignalSet = 8;  // bytes: the size of a signal set in the kernel

template <class... Arguments>
long call(long number, Arguments... arguments) {
  ++counts.system_calls;
  return ::syscall(number, arguments...);
}

}  // namespace

namespace linegate::bench {
ThreadCounts& thread_counts() {
  return counts;
}
}  // namespace linegate::bench

extern "C" {

int recvmmsg(int fd, mmsghdr* messages, unsigned count, int flags, timespec* timeout) {
  return static_cast<int>(call(SYS_recvmmsg, fd, messages, count, flags, timeout));
}
ssize_t send(int fd, const void* data, std::size_t size, int flags) {
  return call(SYS_sendto, fd, data, size, flags, static_cast<void*>(nullptr), 0);
}
int sendmmsg(int fd, mmsghdr* messages, unsigned count, int flags) {
  return static_cast<int>(call(SYS_sendmmsg, fd, messages, count, flags));
}
int epoll_wait(int fd, epoll_event* events, int count, int timeout) {
  ++counts.waits;
  return static_cast<int>(
      call(SYS_epoll_pwait, fd, events, count, timeout, static_cast<void*>(nullptr), kSignalSet));
}
int epoll_pwait2(int fd, epoll_event* events, int count, const timespec* timeout,
                 const sigset_t* signals) {
  ++counts.waits;
  return static_cast<int>(call(SYS_epoll_pwait2, fd, events, count, timeout, signals, kSignalSet));
}
int timerfd_settime(int fd, int flags, const itimerspec* value, itimerspec* before) {
  return static_cast<int>(call(SYS_timerfd_settime, fd, flags, value, before));
}
ssize_t read(int fd, void* data, std::size_t size) {
  return call(SYS_read, fd, data, size);
}
ssize_t write(int fd, const void* data, std::size_t size) {
  return call(SYS_write, fd, data, size);
}

}  // extern "C"
