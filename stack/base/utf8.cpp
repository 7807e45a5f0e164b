// SPDX-License-Identifier: Apache-2.0
#include "stack/base/utf8.h"

#include <array>

namespace linegate {

void append_utf8(std::uint32_t code, std::string& to) {
  if (code < 0x80) {
    to += static_cast<char>(code);
    return;
  }
  const std::size_t more = code < 0x800 ? 1 : code < 0x1'0000 ? 2 : 3;
  constexpr std::array<std::uint32_t, 4> kHead{0, 0xC0, 0xE0, 0xF0};
  to += static_cast<char>(kHead[more] | code >> (6 * more));
  for (std::size_t i = more; i > 0; --i)
    to += static_cast<char>(0x80U | (code >> (6 * (i - 1)) & 0x3FU));
}

std::optional<std::uint32_t> take_code_point(std::string_view& text) {
  const auto octet = [&](std::size_t i) { return static_cast<std::uint8_t>(text[i]); };
  const std::uint8_t first = octet(0);
  const std::size_t size = first < 0x80   ? 1
                           : first < 0xC2 ? 0
                           : first < 0xE0 ? 2
                           : first < 0xF0 ? 3
                           : first < 0xF5 ? 4
                                          : 0;
  if (size == 0 || size > text.size())
    return std::nullopt;
  std::uint32_t code = size == 1 ? first : first & (0xFFU >> (size + 1));
  for (std::size_t i = 1; i < size; ++i) {
    if ((octet(i) & 0xC0U) != 0x80)
      return std::nullopt;
    code = code << 6U | (octet(i) & 0x3FU);
  }
  const bool longer_than_needed = (size == 3 && code < 0x800) || (size == 4 && code < 0x1'0000);
  const bool surrogate = code >= 0xD800 && code <= 0xDFFF;
  if (longer_than_needed || surrogate || code > 0x10'FFFF)
    return std::nullopt;
  text.remove_prefix(size);
  return code;
}

}  // namespace linegate
