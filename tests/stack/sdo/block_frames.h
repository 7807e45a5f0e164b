// SPDX-License-Identifier: Apache-2.0
// Frames of a block transfer in the notation of the tests.
#pragma once

#include "tests/stack/sdo/support.h"

namespace linegate::sdo::test {

// The segments of a value; the last one is filled up with zeros.
inline Frames segments(const std::vector<std::byte>& value, std::size_t begin, std::size_t count) {
  Frames out;
  for (std::size_t i = 0; i < count; ++i) {
    const std::size_t first = (begin + i) * 7;
    Bytes segment(8);
    for (std::size_t n = 0; n < 7 && first + n < value.size(); ++n) {
      segment[n + 1] = std::to_integer<std::uint8_t>(value[first + n]);
    }
    const bool last = first + 7 >= value.size();
    segment[0] = static_cast<std::uint8_t>((i + 1) | (last ? 0x80U : 0U));
    out.push_back(segment);
  }
  return out;
}

inline Bytes end_request(const std::vector<std::byte>& value, std::uint16_t crc) {
  const std::size_t unused = (7 - value.size() % 7) % 7;
  return {static_cast<std::uint8_t>(0xC1U | unused << 2U),
          static_cast<std::uint8_t>(crc),
          static_cast<std::uint8_t>(crc >> 8U),
          0,
          0,
          0,
          0,
          0};
}

inline Bytes block_ack(std::uint8_t ackseq, std::uint8_t block_size) {
  return {0xA2, ackseq, block_size, 0, 0, 0, 0, 0};
}

}  // namespace linegate::sdo::test
