// SPDX-License-Identifier: Apache-2.0
// The clocks of the host: the only place of the gateway that reads them.
#pragma once

#include "bridges/dds/clock_map.h"
#include "stack/base/time.h"

namespace linegate::gateway {

// CLOCK_MONOTONIC.
Instant monotonic_now();

// Measures where the wall clock is, and notices when it was stepped.
class WallClock {
 public:
  WallClock();

  // Looks at both clocks again. Gives by how much the wall clock was stepped since the last look
  // (positive: forward), 0 if it was merely adjusted.
  Duration refresh();

  const dds::ClockMap& map() const { return map_; }

 private:
  dds::ClockMap map_;
};

}  // namespace linegate::gateway
