// SPDX-License-Identifier: Apache-2.0
// A set of node-IDs as four UNSIGNED32: bit 0 of the first is node-ID 1, bit 30 of the last node-ID
// 127 (IXXAT manual 7.2.2).
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace linegate::diagnosis {

class NodeList {
 public:
  static constexpr std::size_t kWords = 4;

  // node: 1..127.
  constexpr void set(std::uint8_t node, bool in = true) {
    const std::uint32_t bit = std::uint32_t{1} << ((node - 1U) % 32U);
    std::uint32_t& word = words_[(node - 1U) / 32U];
    word = in ? word | bit : word & ~bit;
  }
  constexpr bool has(std::uint8_t node) const {
    return ((words_[(node - 1U) / 32U] >> ((node - 1U) % 32U)) & 1U) != 0;
  }
  // number: sub-index minus 1, 0..3.
  constexpr std::uint32_t word(std::size_t number) const { return words_[number]; }

  friend constexpr bool operator==(const NodeList&, const NodeList&) = default;

 private:
  std::array<std::uint32_t, kWords> words_{};
};

// The lists of 5F01h to 5F07h, in this order.
struct NodeLists {
  NodeList assigned;
  NodeList configured;
  NodeList fault;
  NodeList operational;
  NodeList stopped;
  NodeList pre_operational;
  NodeList emergency;

  friend constexpr bool operator==(const NodeLists&, const NodeLists&) = default;
};

}  // namespace linegate::diagnosis
