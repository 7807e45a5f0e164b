// SPDX-License-Identifier: Apache-2.0
// What a fuzz target says when a promise is broken.
#pragma once

#include <cstdio>
#include <cstdlib>

// Aborts, with the promise in words, if it does not hold; in every build type.
#define LINEGATE_EXPECT(condition)                                                        \
  do {                                                                                    \
    if (!(condition)) {                                                                   \
      std::fprintf(stderr, "%s:%d: does not hold: %s\n", __FILE__, __LINE__, #condition); \
      std::abort();                                                                       \
    }                                                                                     \
  } while (false)
