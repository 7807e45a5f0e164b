// SPDX-License-Identifier: Apache-2.0
// Converts between the octets (std::uint8_t) of the generated types and the std::byte of the stack.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <vector>

namespace linegate::dds {

inline void copy_bytes(std::span<const std::byte> from, std::vector<std::uint8_t>& to) {
  to.resize(from.size());
  if (!from.empty())
    std::memcpy(to.data(), from.data(), from.size());
}

inline void copy_bytes(const std::vector<std::uint8_t>& from, std::vector<std::byte>& to) {
  to.resize(from.size());
  if (!from.empty())
    std::memcpy(to.data(), from.data(), from.size());
}

// Appends `from` to `to`.
inline void append_bytes(const std::vector<std::uint8_t>& from, std::vector<std::byte>& to) {
  const std::size_t size = to.size();
  to.resize(size + from.size());
  if (!from.empty())
    std::memcpy(to.data() + size, from.data(), from.size());
}

}  // namespace linegate::dds
