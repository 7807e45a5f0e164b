// SPDX-License-Identifier: Apache-2.0
// Layouts of tests.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "stack/image/layout.h"

namespace linegate::named {

struct TestEntry {
  std::string name;
  od::DataType type = od::DataType::none;
  std::uint16_t bits = 8;
  std::uint8_t node = 5;
  std::uint16_t pdo = 1;
  std::uint16_t index = 0x2000;
  std::uint8_t sub = 0;
};

// Inputs, one behind the other. Their PDOs have the same numbers in the gateway.
inline image::Layout layout_of(const std::vector<TestEntry>& entries) {
  image::Layout layout;
  layout.id = 1;
  std::uint32_t at = 0;
  for (const TestEntry& entry : entries) {
    layout.entries.push_back({.bit_offset = at,
                              .bit_length = entry.bits,
                              .type = entry.type,
                              .node = entry.node,
                              .index = entry.index,
                              .sub = entry.sub,
                              .remote_pdo = entry.pdo,
                              .local_pdo = entry.pdo,
                              .name = entry.name});
    at += entry.bits;
  }
  layout.byte_size = (at + 7) / 8;
  return layout;
}

}  // namespace linegate::named
