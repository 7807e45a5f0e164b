// SPDX-License-Identifier: Apache-2.0
// Converts the kernel's receive stamps, which are of the wall clock, to instants of the monotonic
// clock.
//
// Both clocks are sampled after each batch was read; the age of a stamp on the wall clock is its
// age. A step of the wall clock between reception and sampling would give wrong ages. It shows as a
// change of the difference between the clocks; in that batch the previous difference is considered
// too. A result is never later than the sampling and never before that of an earlier frame. Stamps
// of the controller are used where the kernel's stamp shows what they mean.
#pragma once

#include <cstdint>

#include "bridges/can/hardware_clock.h"
#include "stack/base/time.h"

namespace linegate::can_bridge {

class ReceiveClock {
 public:
  // Takes samples of both clocks from the same moment.
  void begin_batch(Instant monotonic, std::int64_t wall_ns);
  // Reads both clocks.
  void begin_batch();

  // Converts a time stamp (ns since 1970) to an Instant. A frame without a stamp (0) gets the time
  // of the sample, which is later than its reception: no time-out that starts with it ends too
  // early. hardware_ns: stamp of the controller's own clock, 0: none.
  Instant instant(std::int64_t stamp_ns, std::int64_t hardware_ns = 0);

  // The last result of instant().
  Instant latest() const { return latest_; }

 private:
  // Instant::min() if the stamp is implausible.
  Instant of_wall_clock(std::int64_t stamp_ns) const;

  std::int64_t difference_ = 0;  // wall - monotonic, ns
  std::int64_t before_step_ = 0;
  Instant sampled_{};
  Instant latest_ = Instant::min();
  bool started_ = false;
  HardwareClock hardware_;
};

}  // namespace linegate::can_bridge
