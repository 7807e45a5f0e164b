// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <bit>
#include <charconv>

#include "stack/base/byte_order.h"
#include "stack/eds/text.h"
#include "stack/eds/value.h"

namespace linegate::eds {
namespace {

using od::DataType;

constexpr std::uint64_t kLargestDecimal = 9;

std::string number_text(std::uint64_t value) {
  return value <= kLargestDecimal ? std::to_string(value) : format_hex(value);
}

std::string integer(DataType type, std::span<const std::byte> value) {
  const std::uint64_t raw = load_le(value);
  const unsigned bits = od::bit_size(type);
  if (!od::is_signed(type) || (raw >> (bits - 1) & 1U) == 0) {
    return od::is_signed(type) ? std::to_string(raw) : number_text(raw);
  }
  const std::uint64_t mask = ~std::uint64_t{0} >> (64U - bits);
  return '-' + std::to_string((0 - raw) & mask);
}

template <class T>
std::string decimal(T number) {
  char buffer[64];
  const auto result = std::to_chars(std::begin(buffer), std::end(buffer), number);
  return {buffer, result.ptr};
}

std::string real(DataType type, std::span<const std::byte> value) {
  const std::uint64_t raw = load_le(value);
  std::string text = type == DataType::real32
                         ? decimal(std::bit_cast<float>(static_cast<std::uint32_t>(raw)))
                         : decimal(std::bit_cast<double>(raw));
  const Value again = parse_value(type, text, 0);
  const bool same = again.problem.empty() && std::ranges::equal(again.bytes, value);
  return same ? text : format_hex(raw);
}

std::string octets(std::span<const std::byte> value) {
  constexpr std::string_view kDigits = "0123456789ABCDEF";
  std::string out;
  for (const std::byte byte : value) {
    out += kDigits[std::to_integer<unsigned>(byte) >> 4U];
    out += kDigits[std::to_integer<unsigned>(byte) & 0xFU];
  }
  return out;
}

}  // namespace

std::string format_hex(std::uint64_t value, unsigned digits) {
  std::string out = "0x" + hex(value, digits);
  out.pop_back();  // the h
  return out;
}

std::string one_line(std::string_view text) {
  std::string out(text);
  std::replace_if(
      out.begin(), out.end(), [](char c) { return c >= 0 && c < ' '; }, '?');
  return std::string(trim(out));
}

std::string format_value(DataType type, std::span<const std::byte> value, bool formula,
                         std::uint8_t node_id) {
  if (formula && od::is_integer(type) && load_le(value) >= node_id) {
    const std::uint64_t rest = load_le(value) - node_id;
    return rest == 0 ? "$NODEID" : "$NODEID+" + format_hex(rest);
  }
  if (type == DataType::visible_string) {
    return one_line({reinterpret_cast<const char*>(value.data()), value.size()});
  }
  if (type == DataType::unicode_string) {
    return one_line(from_utf16(value));
  }
  if (value.size() != od::byte_size(type)) {
    return octets(value);
  }
  if (od::is_integer(type)) {
    return integer(type, value);
  }
  if (od::is_real(type)) {
    return real(type, value);
  }
  return format_hex(load_le(value));  // time types
}

}  // namespace linegate::eds
