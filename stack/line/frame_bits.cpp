// SPDX-License-Identifier: Apache-2.0
#include "stack/line/frame_bits.h"

namespace linegate::line {
namespace {

// ESI, DLC, stuff count and CRC-17 or CRC-21 with their fixed stuff bits.
constexpr std::uint64_t kShortFdBits = 1 + 4 + 4 + 17 + 6;
constexpr std::uint64_t kLongFdBits = 1 + 4 + 4 + 21 + 7;
constexpr std::uint8_t kShortFdLength = 16;

}  // namespace

std::uint64_t data_phase_bits(std::uint8_t length) {
  return 8U * length + (length <= kShortFdLength ? kShortFdBits : kLongFdBits);
}

std::int64_t bits_on_bus(const can::Header& header, const BitRates& rates) {
  const bool extended = (header.flags & can::Frame::kExtended) != 0;
  std::uint64_t bits = extended ? kExtendedBits : kStandardBits;
  if ((header.flags & can::Frame::kFd) == 0) {
    return static_cast<std::int64_t>((bits + 8U * header.length) * 11 / 10);
  }
  bits = bits - kStandardBits + kFdArbitrationBits;
  std::uint64_t fast = data_phase_bits(can::fd_length(header.length));
  const bool switched = (header.flags & can::Frame::kBitRateSwitch) != 0;
  if (switched && rates.nominal != 0 && rates.data != 0) {
    fast = (fast * rates.nominal + rates.data - 1) / rates.data;
  }
  return static_cast<std::int64_t>((bits + fast) * 11 / 10);
}

}  // namespace linegate::line
