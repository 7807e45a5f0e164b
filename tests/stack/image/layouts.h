// SPDX-License-Identifier: Apache-2.0
// Layouts made by hand for the tests of the image.
#pragma once

#include <cstdint>
#include <vector>

#include "stack/image/layout.h"

namespace linegate::image::test {

inline constexpr auto kIn = Direction::inputs;
inline constexpr auto kOut = Direction::outputs;

struct EntryAt {
  std::uint16_t local_pdo;
  std::uint32_t bit_offset;
  std::uint16_t bit_length;
  std::uint8_t node = 5;
};

inline Layout make_layout(Direction direction, std::uint32_t bytes,
                          const std::vector<EntryAt>& entries) {
  Layout layout;
  layout.direction = direction;
  layout.byte_size = bytes;
  for (const EntryAt& at : entries) {
    Entry entry;
    entry.bit_offset = at.bit_offset;
    entry.bit_length = at.bit_length;
    entry.node = at.node;
    entry.local_pdo = at.local_pdo;
    entry.remote_pdo = static_cast<std::uint16_t>(at.local_pdo + 100);
    layout.entries.push_back(entry);
  }
  layout.id = layout_id(layout);
  return layout;
}

inline Layout no_outputs() {
  return make_layout(Direction::outputs, 0, {});
}

}  // namespace linegate::image::test
