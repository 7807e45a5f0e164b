// SPDX-License-Identifier: Apache-2.0
// Selects lines, nodes and rows for display.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace linegate::console {

struct Filter {
  std::string line;                // name or network-ID; empty = all
  std::uint8_t node = 0;           // 0 = all
  std::vector<std::string> words;  // each must occur in a cell of the row, in any case

  bool empty() const { return line.empty() && node == 0 && words.empty(); }
  friend bool operator==(const Filter&, const Filter&) = default;
};

// Parses a filter as typed: "line=press node=5 temperature". Returns nothing if a node is not a
// number from 1 to 127.
std::optional<Filter> parse_filter(const std::string& text);
// The inverse of parse_filter().
std::string text_of(const Filter& filter);

}  // namespace linegate::console
