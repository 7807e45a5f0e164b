// SPDX-License-Identifier: Apache-2.0
// Texts in fields of a limited length.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace linegate {

// Returns the text, or as much of it as fits with "..." at the end. UTF-8 characters remain whole.
// most: length of the result at most, in bytes, at least 3.
inline std::string short_text(std::string_view text, std::size_t most) {
  constexpr std::string_view kEnd = "...";
  if (text.size() <= most)
    return std::string(text);
  const auto continues = [](char c) { return (static_cast<unsigned char>(c) & 0xC0U) == 0x80U; };
  std::size_t length = most - kEnd.size();
  while (length > 0 && continues(text[length]))
    --length;
  return std::string(text.substr(0, length)).append(kEnd);
}

}  // namespace linegate
