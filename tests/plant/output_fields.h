// Where the output entries of a line are in the frames of its RPDOs.
#pragma once

#include <cstddef>
#include <cstdint>

#include "stack/image/layout.h"
#include "stack/pdo/parameters.h"

namespace linegate::plant {

// take(place of the entry in the layout, its object, its first bit in the frame) for each entry
// that the RPDO of the node carries.
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
