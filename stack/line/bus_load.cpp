// SPDX-License-Identifier: Apache-2.0
#include "stack/line/bus_load.h"

#include <algorithm>
#include <utility>

#include "stack/line/frame_bits.h"

namespace linegate::line {
namespace {

// Factor for the data that can be stuffed.
constexpr double kStuffing = 1.1;

}  // namespace

std::uint64_t BusLoad::bits(const can::Traffic& traffic) {
  const std::uint64_t standard = traffic.frames - traffic.extended;
  return standard * kStandardBits + traffic.extended * kExtendedBits + traffic.bytes * 8U;
}

void BusLoad::set_bit_rates(std::uint32_t bit_rate, std::uint32_t data_bit_rate) {
  bit_rate_ = bit_rate;
  data_bit_rate_ = bit_rate != 0 ? data_bit_rate : 0;
  wants_fast_ = expects_fd_ || data_bit_rate_ != 0;
}

// The remaining identifier bits of an extended frame are sent at the nominal bit rate, too.
std::uint64_t BusLoad::count_fast(std::span<const can::Frame> frames) {
  std::uint64_t fd = 0;
  for (const can::Frame& frame : frames) {
    fd += frame.fd() ? 1U : 0U;
    if (data_bit_rate_ == 0 || (frame.flags & can::Frame::kBitRateSwitch) == 0) {
      continue;
    }
    const std::uint64_t data = frame.length * 8U;
    not_nominal_ += kStandardBits - kFdArbitrationBits + data;
    fast_bits_ += data_phase_bits(frame.length);
  }
  return fd;
}

void BusLoad::advance(const can::Traffic& seen, Instant now) {
  const Duration elapsed = now - window_start_;
  if (!is_due(now)) {
    return;
  }
  window_start_ = now;
  const std::uint64_t all = bits(seen);
  std::uint64_t unstuffed = all - std::exchange(bits_before_, all);
  unstuffed -= std::min(unstuffed, std::exchange(not_nominal_, 0));
  const auto fast = static_cast<double>(std::exchange(fast_bits_, 0));
  if (bit_rate_ == 0) {
    return;
  }
  double on_wire = static_cast<double>(unstuffed) * kStuffing / bit_rate_;
  if (data_bit_rate_ != 0) {
    on_wire += fast * kStuffing / data_bit_rate_;
  }
  const double share = on_wire / std::chrono::duration<double>(elapsed).count();
  permille_ = static_cast<std::uint16_t>(std::clamp(share * 1000.0, 0.0, 1000.0));
}

}  // namespace linegate::line
