// SPDX-License-Identifier: Apache-2.0
#include "tests/bench/numbers_in_image.h"

#include <algorithm>
#include <cstddef>
#include <utility>

#include "tests/bench/load_sender.h"

namespace linegate::bench {

NumbersInImage::NumbersInImage(image::Layout layout) : layout_(std::move(layout)) {
  std::uint16_t highest = 0;
  for (const image::Entry& entry : layout_.entries) {
    highest = std::max(highest, entry.local_pdo);
  }
  last_.resize(std::size_t{highest} + 1);
}

void NumbersInImage::take(const image::Snapshot& snapshot) {
  for (const image::PdoMark& mark : snapshot.marks) {
    std::uint32_t number = 0;
    if (!number_of(value(snapshot, mark), number)) {
      ++torn_;
      continue;
    }
    std::uint32_t& last = last_[mark.local_pdo];
    const std::uint32_t passed = number - last;
    missing_ += passed == mark.count ? 0 : std::max<std::uint64_t>(1, passed - mark.count);
    last = number;
    frames_ += mark.count;
  }
}

std::uint64_t NumbersInImage::value(const image::Snapshot& snapshot,
                                    const image::PdoMark& mark) const {
  std::uint64_t out = 0;
  unsigned shift = 0;
  for (std::uint32_t i = mark.first_entry; i < mark.first_entry + mark.entries; ++i) {
    const image::Entry& entry = layout_.entries[i];
    for (unsigned byte = 0; byte < entry.bit_length / 8U && shift < 64; ++byte, shift += 8) {
      const auto at = snapshot.bytes[entry.bit_offset / 8U + byte];
      out |= std::to_integer<std::uint64_t>(at) << shift;
    }
  }
  return out;
}

}  // namespace linegate::bench
