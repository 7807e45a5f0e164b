// SPDX-License-Identifier: Apache-2.0
// The positions of the output entries of a line in the frames of its RPDOs.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "stack/can/frame.h"
#include "stack/image/layout.h"
#include "stack/od/description.h"
#include "stack/pdo/parameters.h"

namespace linegate::plant {

// At most 64 bits, the first one is the least significant.
inline std::uint64_t bits_of(std::span<const std::byte> bytes, unsigned first, unsigned count) {
  constexpr unsigned kByte = 8;
  std::uint64_t out = 0;
  for (unsigned done = 0; done < std::min(count, 64U);) {
    const unsigned at = first + done;
    const unsigned taken = std::min(kByte - at % kByte, std::min(count, 64U) - done);
    const unsigned part = std::to_integer<unsigned>(bytes[at / kByte]) >> (at % kByte);
    out |= std::uint64_t{part & ((1U << taken) - 1U)} << done;
    done += taken;
  }
  return out;
}

// The PDOs in the file of a device. fd: on a line of CANopen FD.
inline Loaded<pdo::DevicePdos> pdos_in(const od::DeviceDescription& file, bool fd) {
  return pdo::describe_pdos(file, 8 * (fd ? can::kMaxFdData : can::kMaxClassicData));
}

// The values of a PDO as the bits of its frame.
using PdoValues = std::array<std::uint64_t, can::kMaxFdData / 8>;

// count: at most 64. Precondition: these bits are 0.
inline void put_bits(PdoValues& out, unsigned first, unsigned count, std::uint64_t value) {
  constexpr unsigned kWord = 64;
  const unsigned shift = first % kWord;
  out[first / kWord] |= value << shift;
  if (shift + count > kWord) {
    out[first / kWord + 1] |= value >> (kWord - shift);
  }
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
