// SPDX-License-Identifier: Apache-2.0
#include <charconv>

#include "stack/od/description.h"

namespace linegate::od {
namespace {

std::optional<unsigned> hexadecimal_number(std::string_view text, unsigned highest) {
  if (text.starts_with("0x") || text.starts_with("0X")) {
    text.remove_prefix(2);
  }
  unsigned value = 0;
  const char* const end = text.data() + text.size();
  const auto [rest, error] = std::from_chars(text.data(), end, value, 16);
  if (text.empty() || error != std::errc{} || rest != end || value > highest) {
    return std::nullopt;
  }
  return value;
}

}  // namespace

std::string to_text(Address address) {
  constexpr std::string_view kDigits = "0123456789ABCDEF";
  const auto digit = [&](unsigned value) { return kDigits[value & 0xFU]; };
  const unsigned i = address.index;
  const unsigned s = address.sub;
  return {digit(i >> 12U), digit(i >> 8U), digit(i >> 4U), digit(i), ':', digit(s >> 4U), digit(s)};
}

std::optional<std::uint16_t> parse_index(std::string_view text) {
  const auto index = hexadecimal_number(text, 0xFFFF);
  return index ? std::optional(static_cast<std::uint16_t>(*index)) : std::nullopt;
}

std::optional<std::uint8_t> parse_sub(std::string_view text) {
  const auto sub = hexadecimal_number(text, 0xFF);
  return sub ? std::optional(static_cast<std::uint8_t>(*sub)) : std::nullopt;
}

std::optional<Address> parse_address(std::string_view text) {
  const std::size_t colon = text.find(':');
  const auto index = parse_index(text.substr(0, colon));
  const auto sub = colon == std::string_view::npos ? std::optional<std::uint8_t>(std::uint8_t{0})
                                                   : parse_sub(text.substr(colon + 1));
  return index && sub ? std::optional(Address{*index, *sub}) : std::nullopt;
}

}  // namespace linegate::od
