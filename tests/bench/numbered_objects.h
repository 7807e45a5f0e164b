// SPDX-License-Identifier: Apache-2.0
// Objects of one UNSIGNED32 each, whose values follow from their indices.
#pragma once

#include <cstddef>
#include <cstdint>
#include <random>
#include <span>
#include <vector>

#include "stack/base/byte_order.h"
#include "stack/od/description.h"

namespace linegate::bench {

inline constexpr std::uint16_t kFirstObject = 0x2000;

inline std::uint32_t value_of(std::uint16_t index) {
  return 0x12340000U + index;
}

// The object with that number, from 0. Its index is kFirstObject + number.
inline od::ObjectDescription numbered_object(std::size_t number, od::Access access) {
  const auto index = static_cast<std::uint16_t>(kFirstObject + number);
  od::ObjectDescription object{.index = index, .name = "Value"};
  object.variables.push_back({.sub = 0,
                              .name = "Value",
                              .type = od::DataType::unsigned32,
                              .access = access,
                              .value = std::vector<std::byte>(4)});
  store_le(std::span(object.variables[0].value), std::uint64_t{value_of(index)});
  return object;
}

// `count` indices of these objects in seeded random order.
inline std::vector<std::uint16_t> random_indices(std::size_t objects, std::size_t count) {
  std::mt19937 random(7);
  std::vector<std::uint16_t> out;
  for (std::size_t i = 0; i < count; ++i) {
    out.push_back(static_cast<std::uint16_t>(kFirstObject + random() % objects));
  }
  return out;
}

}  // namespace linegate::bench
