// SPDX-License-Identifier: Apache-2.0
// A library that is loaded before all others: the clock of the day is CLOCK_SHIFT seconds ahead.
#include <cstdlib>

#include <dlfcn.h>
#include <time.h>

extern "C" int clock_gettime(clockid_t clock, timespec* time) {
  using Function = int (*)(clockid_t, timespec*);
  static const auto original = reinterpret_cast<Function>(::dlsym(RTLD_NEXT, "clock_gettime"));
  const int out = original(clock, time);
  const char* const shift = std::getenv("CLOCK_SHIFT");
  if (out == 0 && clock == CLOCK_REALTIME && shift != nullptr)
    time->tv_sec += std::atoi(shift);
  return out;
}
