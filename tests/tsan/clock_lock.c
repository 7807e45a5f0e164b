// SPDX-License-Identifier: Apache-2.0
/* pthread_mutex_clocklock for the thread sanitizer of Clang 14, which does not know it: without
   this, the timed mutexes of Fast DDS look as if nobody had locked them. pthread_mutex_timedlock,
   which it knows, waits by the real-time clock. */
#define _GNU_SOURCE
#include <errno.h>
#include <pthread.h>
#include <time.h>

enum { kNanosecondsPerSecond = 1000000000 };

int pthread_mutex_clocklock(pthread_mutex_t* mutex, clockid_t clock,
                            const struct timespec* deadline) {
  struct timespec now;
  struct timespec until;
  if (clock_gettime(clock, &now) != 0 || clock_gettime(CLOCK_REALTIME, &until) != 0) {
    return EINVAL;
  }
  until.tv_sec += deadline->tv_sec - now.tv_sec;
  until.tv_nsec += deadline->tv_nsec - now.tv_nsec;
  if (until.tv_nsec < 0) {
    until.tv_nsec += kNanosecondsPerSecond;
    --until.tv_sec;
  } else if (until.tv_nsec >= kNanosecondsPerSecond) {
    until.tv_nsec -= kNanosecondsPerSecond;
    ++until.tv_sec;
  }
  return pthread_mutex_timedlock(mutex, &until);
}
