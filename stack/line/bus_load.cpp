#include "stack/line/bus_load.h"

#include <algorithm>
#include <utility>

namespace linegate::line {
namespace {

constexpr Duration kWindow = std::chrono::seconds(1);

}  // namespace

std::uint64_t BusLoad::bits(const can::Traffic& traffic) {
  const std::uint64_t standard = traffic.frames - traffic.extended;
  return standard * kStandardBits + traffic.extended * kExtendedBits + traffic.bytes * 8U;
}

void BusLoad::advance(const can::Traffic& seen, Instant now) {
  const Duration elapsed = now - window_start_;
  if (elapsed < kWindow) {
    return;
  }
  window_start_ = now;
  const std::uint64_t all = bits(seen);
  const std::uint64_t unstuffed = all - std::exchange(bits_before_, all);
  if (bit_rate_ == 0) {
    return;
  }
  const double seconds = std::chrono::duration<double>(elapsed).count();
  const double bits = static_cast<double>(unstuffed) * 1.1;
  const double share = bits / (seconds * bit_rate_);
  permille_ = static_cast<std::uint16_t>(std::clamp(share * 1000.0, 0.0, 1000.0));
}

}  // namespace linegate::line
