// SPDX-License-Identifier: Apache-2.0
// A deadline from a time-out that a stranger chose.
#pragma once

#include "stack/base/assert.h"
#include "stack/base/time.h"

namespace linegate {

// now + timeout; kNever if that lies beyond the end of time. Precondition: now >= 0, timeout >= 0.
constexpr Instant deadline(Instant now, Duration timeout) {
  LINEGATE_ASSERT(now >= Instant{} && timeout >= Duration::zero(), "time is not negative");
  return timeout < kNever - now ? now + timeout : kNever;
}

}  // namespace linegate
