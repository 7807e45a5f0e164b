// SPDX-License-Identifier: Apache-2.0
#include "stack/eds/value.h"

#include <bit>
#include <charconv>
#include <cmath>
#include <limits>

#include "stack/base/byte_order.h"
#include "stack/eds/text.h"

namespace linegate::eds {
namespace {

using od::DataType;

Value no_value(std::string problem) {
  Value value;
  value.problem = std::move(problem);
  return value;
}

Value little_endian(std::uint64_t raw, std::size_t size) {
  Value value;
  value.bytes.resize(size);
  store_le(std::span<std::byte>(value.bytes), raw);
  return value;
}

// The largest number of an integer type.
std::uint64_t largest(DataType type) {
  const unsigned bits = od::bit_size(type) - (od::is_signed(type) ? 1U : 0U);
  return ~std::uint64_t{0} >> (64U - bits);
}

bool fits(DataType type, const Number& number) {
  if (!od::is_signed(type)) {
    return number.magnitude <= largest(type) && (!number.negative || number.magnitude == 0);
  }
  if (number.negative) {
    return number.magnitude <= largest(type) + 1;
  }
  const bool is_pattern = number.hexadecimal && number.magnitude <= 2 * largest(type) + 1;
  return number.magnitude <= largest(type) || is_pattern;
}

std::string range(DataType type) {
  const std::string high = std::to_string(largest(type));
  const std::string low = od::is_signed(type) ? '-' + std::to_string(largest(type) + 1) : "0";
  return low + " to " + high;
}

Value integer(DataType type, std::string_view text, std::uint8_t node_id) {
  if (type == DataType::boolean && equal_ignoring_case(text, "true")) {
    return little_endian(1, 1);
  }
  if (type == DataType::boolean && equal_ignoring_case(text, "false")) {
    return little_endian(0, 1);
  }
  const Number number = parse_formula(text, node_id);
  if (!number.ok()) {
    return no_value(number.problem);
  }
  if (!fits(type, number)) {
    return no_value(quote(text) + " does not fit " + std::string(od::name(type)) + " (" +
                    range(type) + ')');
  }
  const std::uint64_t raw = number.negative ? 0 - number.magnitude : number.magnitude;
  Value value = little_endian(raw, od::byte_size(type));
  value.remark = number.remark;
  value.uses_node_id = number.uses_node_id;
  return value;
}

Value bit_pattern(DataType type, std::string_view text) {
  const Number number = parse_number(text);
  if (!number.ok()) {
    return no_value(number.problem);
  }
  const unsigned bits = od::bit_size(type);
  if (number.negative || (bits < 64 && number.magnitude >> bits != 0)) {
    return no_value(quote(text) + " does not fit " + std::string(od::name(type)) + " (" +
                    std::to_string(bits) + " bits)");
  }
  return little_endian(number.magnitude, od::byte_size(type));
}

Value real(DataType type, std::string_view text) {
  if (text.starts_with("0x") || text.starts_with("0X")) {
    return bit_pattern(type, text);
  }
  const std::string_view digits = text.starts_with('+') ? text.substr(1) : text;
  double number = 0;
  const char* end = digits.data() + digits.size();
  const auto [stop, error] = std::from_chars(digits.data(), end, number);
  if (stop != end || error == std::errc::invalid_argument) {
    return no_value(quote(text) + " is not a number");
  }
  const bool is_single = type == DataType::real32;
  if (error != std::errc() || (is_single && std::isfinite(number) &&
                               std::abs(number) > std::numeric_limits<float>::max())) {
    return no_value(quote(text) + " does not fit " + std::string(od::name(type)));
  }
  return is_single ? little_endian(std::bit_cast<std::uint32_t>(static_cast<float>(number)), 4)
                   : little_endian(std::bit_cast<std::uint64_t>(number), 8);
}

Value octets(std::string_view text) {
  if (text.starts_with("0x") || text.starts_with("0X")) {
    text.remove_prefix(2);  // not CiA 306, but common
  }
  Value value;
  unsigned digits = 0;
  unsigned octet = 0;
  for (const char c : text) {
    if (c == ' ' || c == '\t') {
      continue;
    }
    unsigned digit = 0;
    if (std::from_chars(&c, &c + 1, digit, 16).ec != std::errc()) {
      return no_value(quote(text) + " is not made of hexadecimal digits");
    }
    octet = octet << 4U | digit;
    if (++digits % 2 == 0) {
      value.bytes.push_back(static_cast<std::byte>(octet));
    }
  }
  return digits % 2 == 0 ? value : no_value(quote(text) + " has half a byte at its end");
}

}  // namespace

Value parse_value(DataType type, std::string_view text, std::uint8_t node_id) {
  Value value;
  if (type == DataType::visible_string) {
    const auto raw = std::as_bytes(std::span(text));
    value.bytes.assign(raw.begin(), raw.end());
    return value;
  }
  if (type == DataType::unicode_string) {
    value.bytes = to_utf16(text);
    return value;
  }
  const std::string_view content = without_comment(text);
  if (od::is_integer(type)) {
    return integer(type, content, node_id);
  }
  if (od::is_real(type)) {
    return real(type, content);
  }
  return od::byte_size(type) != 0 ? bit_pattern(type, content) : octets(content);
}

}  // namespace linegate::eds
