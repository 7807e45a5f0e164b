// SPDX-License-Identifier: Apache-2.0
// A thread of the library that makes no progress.
#pragma once

#include "stack/base/time.h"

namespace linegate::dds::guard {

struct Stall {
  Duration time{};  // 0: none
  int thread = 0;   // as gettid(2) in that thread; 0: not known
};

}  // namespace linegate::dds::guard
