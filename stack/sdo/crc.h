// SPDX-License-Identifier: Apache-2.0
// The check sum of block transfer (CiA 301, 7.2.4.3.16): polynomial x^16 + x^12 + x^5 + 1, begun
// with 0000h, most significant bit first, no final inversion. "123456789" gives 31C3h.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

namespace linegate::sdo {

inline constexpr std::array<std::uint16_t, 256> kCrcTable = [] {
  std::array<std::uint16_t, 256> table{};
  for (unsigned byte = 0; byte < table.size(); ++byte) {
    unsigned rest = byte << 8U;
    for (int bit = 0; bit < 8; ++bit) {
      rest = (rest & 0x8000U) != 0 ? (rest << 1U) ^ 0x1021U : rest << 1U;
    }
    table[byte] = static_cast<std::uint16_t>(rest);
  }
  return table;
}();

// The check sum of what gave `crc` so far, followed by bytes.
inline std::uint16_t crc_of(std::span<const std::byte> bytes, std::uint16_t crc = 0) {
  for (const std::byte byte : bytes) {
    const unsigned place = (static_cast<unsigned>(crc) >> 8U) ^ std::to_integer<unsigned>(byte);
    crc = static_cast<std::uint16_t>(static_cast<unsigned>(crc) << 8U ^ kCrcTable[place & 0xFFU]);
  }
  return crc;
}

}  // namespace linegate::sdo
