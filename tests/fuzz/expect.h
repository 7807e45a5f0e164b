// SPDX-License-Identifier: Apache-2.0
// The check of a promise in a fuzz target.
#pragma once

#include <cstdio>
#include <cstdlib>

// Aborts and prints the condition if it does not hold, in every build type.
#define LINEGATE_EXPECT(condition)                                                        \
  do {                                                                                    \
    if (!(condition)) {                                                                   \
      std::fprintf(stderr, "%s:%d: does not hold: %s\n", __FILE__, __LINE__, #condition); \
      std::abort();                                                                       \
    }                                                                                     \
  } while (false)
