// SPDX-License-Identifier: Apache-2.0
// Converts time stamps of a CAN controller's own clock to instants of the monotonic clock.
//
// That clock has its own origin and rate. A hardware stamp is taken when the frame is received, the
// kernel's stamp later, when the interrupt or USB packet is served. The smallest difference between
// the two is the offset of the clocks, best known from a frame that was served at once. It is
// searched for among the frames of the last one to two kWindow, so that it follows the drift: at 50
// ppm by at most 50 us in that time.
#pragma once

#include <cstdint>

#include "stack/base/time.h"

struct ethtool_ts_info;

namespace linegate::can_bridge {

// Whether an interface that says this of itself (ETHTOOL_GET_TS_INFO) stamps all frames it receives
// with a clock that can be read from the frames.
bool offers_hardware_stamps(const ethtool_ts_info& info);

class HardwareClock {
 public:
  static constexpr Duration kWindow = std::chrono::milliseconds(500);
  // A frame does not wait longer between controller and kernel: if it seems so, the controller's
  // clock was set anew, as when it was reset.
  static constexpr Duration kLongest = std::chrono::milliseconds(250);

  // hardware: ns of the controller's clock, not 0. received: the kernel's stamp of the same frame.
  // Never later than received.
  Instant instant(std::int64_t hardware, Instant received);

 private:
  void begin_window(Duration difference, Instant received);

  bool started_ = false;
  Instant window_begin_{};
  Duration smallest_{};         // kernel - hardware, in this window
  Duration smallest_before_{};  // and in the one before
};

}  // namespace linegate::can_bridge
