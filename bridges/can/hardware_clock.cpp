// SPDX-License-Identifier: Apache-2.0
#include "bridges/can/hardware_clock.h"

#include <algorithm>
#include <utility>

#include <linux/ethtool.h>
#include <linux/net_tstamp.h>

namespace linegate::can_bridge {

bool offers_hardware_stamps(const ethtool_ts_info& info) {
  constexpr std::uint32_t kNeeded =
      std::uint32_t{SOF_TIMESTAMPING_RX_HARDWARE} | std::uint32_t{SOF_TIMESTAMPING_RAW_HARDWARE};
  constexpr std::uint32_t kAllFrames = std::uint32_t{1} << HWTSTAMP_FILTER_ALL;
  return (info.so_timestamping & kNeeded) == kNeeded && (info.rx_filters & kAllFrames) != 0;
}

Instant HardwareClock::instant(std::int64_t hardware, Instant received) {
  const Duration difference = received.time_since_epoch() - Duration(hardware);
  if (!started_ || difference > std::min(smallest_, smallest_before_) + kLongest) {
    started_ = true;
    window_begin_ = received;
    smallest_ = smallest_before_ = difference;
  }
  if (received - window_begin_ >= kWindow) {
    begin_window(difference, received);
  }
  smallest_ = std::min(smallest_, difference);
  return Instant(Duration(hardware) + std::min(smallest_, smallest_before_));
}

// After a silence what was known is too old to count.
void HardwareClock::begin_window(Duration difference, Instant received) {
  const bool silent = received - window_begin_ >= 2 * kWindow;
  smallest_before_ = silent ? difference : smallest_;
  smallest_ = difference;
  window_begin_ = received;
}

}  // namespace linegate::can_bridge
