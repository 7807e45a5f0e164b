// SPDX-License-Identifier: Apache-2.0
// Byte order conversion: everything on a CAN bus and in a process image is little-endian.
#pragma once

#include <bit>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>

#include "stack/base/assert.h"

namespace linegate {

// The unsigned integer at p, least significant byte first. Reads sizeof(T) bytes, any alignment.
template <std::unsigned_integral T>
inline T load_le(const std::byte* p) {
  T value;
  std::memcpy(&value, p, sizeof value);
  if constexpr (std::endian::native == std::endian::big) {
    T swapped = 0;
    for (std::size_t i = 0; i < sizeof value; ++i) {
      swapped = static_cast<T>((swapped << 8U) | ((value >> (8U * i)) & 0xFFU));
    }
    value = swapped;
  }
  return value;
}

// Writes value at p, least significant byte first. Writes sizeof(T) bytes, any alignment.
template <std::unsigned_integral T>
inline void store_le(std::byte* p, T value) {
  if constexpr (std::endian::native == std::endian::big) {
    for (std::size_t i = 0; i < sizeof value; ++i) {
      p[i] = static_cast<std::byte>(value >> (8U * i));
    }
  } else {
    std::memcpy(p, &value, sizeof value);
  }
}

// The unsigned integer in 0 to 8 bytes, least significant byte first: for the types of 24 to 56
// bits.
inline std::uint64_t load_le(std::span<const std::byte> bytes) {
  std::uint64_t value = 0;
  for (std::size_t i = bytes.size(); i-- > 0;) {
    value = (value << 8U) | std::to_integer<std::uint64_t>(bytes[i]);
  }
  return value;
}

// The same for a two's complement integer of 1 to 8 bytes: the sign is extended to 64 bits.
inline std::int64_t load_le_signed(std::span<const std::byte> bytes) {
  LINEGATE_ASSERT(!bytes.empty() && bytes.size() <= sizeof(std::int64_t),
                  "the number has 8 to 64 bits");
  const unsigned unused = 64U - 8U * static_cast<unsigned>(bytes.size());
  return static_cast<std::int64_t>(load_le(bytes) << unused) >> unused;
}

// Writes the low bytes.size() (at most 8) bytes of value, least significant first.
inline void store_le(std::span<std::byte> bytes, std::uint64_t value) {
  for (std::byte& b : bytes) {
    b = static_cast<std::byte>(value);
    value >>= 8U;
  }
}

}  // namespace linegate
