// SPDX-License-Identifier: Apache-2.0
// Which lines, nodes and rows are to be seen.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace linegate::console {

struct Filter {
  std::string line;                // name or network-ID; empty = all
  std::uint8_t node = 0;           // 0 = all
  std::vector<std::string> words;  // each is in some cell of a row, whatever the case

  bool empty() const { return line.empty() && node == 0 && words.empty(); }
  friend bool operator==(const Filter&, const Filter&) = default;
};

// As somebody types it: "line=press node=5 temperature", blanks in between. Nothing if a node is no
// number from 1 to 127.
std::optional<Filter> parse_filter(const std::string& text);
// The same text again.
std::string text_of(const Filter& filter);

}  // namespace linegate::console
