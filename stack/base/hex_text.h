// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

namespace linegate {

// A number as CiA documents write it, with at least that many digits: "1A03h".
inline std::string hex_text(std::uint32_t value, std::size_t digits) {
  constexpr std::string_view kDigits = "0123456789ABCDEF";
  std::string text;
  for (; text.size() < digits || value != 0; value >>= 4U) {
    text.insert(text.begin(), kDigits[value & 0xFU]);
  }
  return text + "h";
}

}  // namespace linegate
