// SPDX-License-Identifier: Apache-2.0
// The positions of the output entries of a line in the frames of its RPDOs.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>

#include "stack/image/layout.h"
#include "stack/pdo/parameters.h"

namespace linegate::plant {

// At most 64 bits, the first one is the least significant.
inline std::uint64_t bits_of(std::span<const std::byte> bytes, unsigned first, unsigned count) {
  std::uint64_t out = 0;
  for (unsigned i = 0; i < std::min(count, 64U); ++i) {
    const unsigned at = first + i;
    out |= std::uint64_t{std::to_integer<unsigned>(bytes[at / 8] >> (at % 8)) & 1U} << i;
  }
  return out;
}

// Calls take(index of the entry in the layout, its object, its first bit in the frame) for each
// entry that the RPDO of the node carries.
template <class Take>
void each_output(const image::Layout& layout, std::uint8_t node, const pdo::Parameters& rpdo,
                 Take take) {
  unsigned bit = 0;
  for (const pdo::Mapping& mapping : rpdo.mapping) {
    for (std::size_t i = 0; i < layout.entries.size(); ++i) {
      const image::Entry& entry = layout.entries[i];
      if (entry.node == node && entry.remote_pdo == rpdo.number &&
          od::Address{entry.index, entry.sub} == mapping.address) {
        take(i, mapping.address, bit);
      }
    }
    bit += mapping.bits;
  }
}

}  // namespace linegate::plant
