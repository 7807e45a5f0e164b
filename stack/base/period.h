// SPDX-License-Identifier: Apache-2.0
// Cyclic work that neither drifts nor bursts.
#pragma once

#include "stack/base/assert.h"
#include "stack/base/time.h"

namespace linegate {

// When work that was due at `due` is due next: one period later. Periods that have passed by `now`
// are left out, so that a late caller does not make up for them all at once; the result lies on the
// grid of `due` and after `now`. Precondition: period > 0.
constexpr Instant next_after(Instant due, Duration period, Instant now) {
  LINEGATE_ASSERT(period > Duration::zero(), "the period is positive");
  const Instant next = due + period;
  return next > now ? next : next + ((now - next) / period + 1) * period;
}

}  // namespace linegate
