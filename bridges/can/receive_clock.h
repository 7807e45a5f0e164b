// The kernel's receive stamps, which are of the wall clock, as instants of the monotonic clock.
//
// Both clocks are sampled after each batch was read; a stamp's age by the wall clock is its age. A
// step of the wall clock between reception and sampling would give wrong ages: it shows as a change
// of the difference between the clocks, and in that batch the difference before counts too.
// Whatever comes out is never in the future and never before an earlier frame.
#pragma once

#include <cstdint>

#include "stack/base/time.h"

namespace linegate::can_bridge {

class ReceiveClock {
 public:
  // Samples of both clocks, taken at the same moment. now: what no frame may be later than.
  void begin_batch(Instant monotonic, std::int64_t wall_ns, Instant now);
  // Reads both clocks.
  void begin_batch(Instant now);

  // The instant of a stamp, ns since 1970; 0 = the frame has none.
  Instant instant(std::int64_t stamp_ns);

 private:
  bool plausible(Instant time) const;

  std::int64_t difference_ = 0;  // wall - monotonic, ns
  std::int64_t before_step_ = 0;
  bool started_ = false;
  Instant sampled_{};
  Instant now_{};
  Instant latest_{};
};

}  // namespace linegate::can_bridge
