// SPDX-License-Identifier: Apache-2.0
#include "bridges/console/value_text.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cctype>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <type_traits>
#include <utility>

#include "bridges/console/table.h"
#include "stack/base/byte_order.h"
#include "stack/image/scaling.h"

namespace linegate::console {
namespace {

// The fewest digits that give the same value of this type. Without an exponent where all digits of
// the integer part are significant.
template <class Real>
std::string number_text(Real value) {
  constexpr Real kEnd = std::is_same_v<Real, float> ? Real{1e9} : static_cast<Real>(1e16);
  const Real size = std::abs(value);
  const bool plain = value == 0 || (size >= static_cast<Real>(1e-4) && size < kEnd);
  std::array<char, 64> digits{};
  const auto end = std::to_chars(digits.data(), digits.data() + digits.size(), value,
                                 plain ? std::chars_format::fixed : std::chars_format::scientific)
                       .ptr;
  return {digits.data(), end};
}

std::string string_text(std::span<const std::byte> value) {
  std::string out = "\"";
  for (const std::byte b : value) {
    const auto c = static_cast<char>(b);
    if (c == '"' || c == '\\') {
      out += '\\';
    }
    out += std::isprint(static_cast<unsigned char>(c)) != 0 ? c : '.';
  }
  return out + '"';
}

std::vector<std::byte> little_endian(std::uint64_t value, unsigned bytes) {
  std::vector<std::byte> out(bytes);
  store_le(std::span(out), value);
  return out;
}

// The digits of an integer, without sign and 0x.
std::optional<std::uint64_t> magnitude(std::string_view text) {
  const bool hex = text.starts_with("0x") || text.starts_with("0X");
  const std::string_view digits = hex ? text.substr(2) : text;
  std::uint64_t value = 0;
  const auto [end, error] =
      std::from_chars(digits.data(), digits.data() + digits.size(), value, hex ? 16 : 10);
  if (digits.empty() || error != std::errc{} || end != digits.data() + digits.size()) {
    return std::nullopt;
  }
  return value;
}

std::optional<std::vector<std::byte>> integer(od::DataType type, std::string_view text) {
  const bool negative = text.starts_with('-');
  const auto value = magnitude(negative ? text.substr(1) : text);
  const unsigned bits = type == od::DataType::boolean ? 1 : od::bit_size(type);
  const unsigned bytes = od::byte_size(type);
  if (!value) {
    return std::nullopt;
  }
  const std::uint64_t top = std::uint64_t{1} << (bits - 1);  // the lowest negative, as a magnitude
  if (negative) {
    return od::is_signed(type) && *value <= top ? std::optional(little_endian(~*value + 1, bytes))
                                                : std::nullopt;
  }
  const std::uint64_t largest = od::is_signed(type) ? top - 1 : top - 1 + top;
  return *value <= largest ? std::optional(little_endian(*value, bytes)) : std::nullopt;
}

std::optional<std::vector<std::byte>> real(od::DataType type, std::string_view text) {
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (text.empty() || error != std::errc{} || end != text.data() + text.size()) {
    return std::nullopt;
  }
  if (type == od::DataType::real32) {
    // Directly: by way of a double it may be rounded twice. Without a result it is too large, or
    // below the least.
    float number = 0;
    const bool is_out =
        std::from_chars(text.data(), text.data() + text.size(), number).ec != std::errc{};
    if (is_out && std::abs(value) > 1) {
      return std::nullopt;
    }
    if (is_out) {
      number = static_cast<float>(value);
    }
    return little_endian(std::bit_cast<std::uint32_t>(number), 4);
  }
  return little_endian(std::bit_cast<std::uint64_t>(value), 8);
}

std::optional<std::vector<std::byte>> hex_bytes(std::string_view text) {
  std::vector<std::byte> out;
  std::string digits;
  for (const char c : text) {
    if (std::isxdigit(static_cast<unsigned char>(c)) != 0) {
      digits += c;
    } else if (c != ' ' && c != ':') {
      return std::nullopt;
    }
  }
  if (digits.size() % 2 != 0) {
    return std::nullopt;
  }
  for (std::size_t i = 0; i < digits.size(); i += 2) {
    unsigned value = 0;
    std::from_chars(digits.data() + i, digits.data() + i + 2, value, 16);
    out.push_back(static_cast<std::byte>(value));
  }
  return out;
}

}  // namespace

std::string hex_digits(std::uint32_t value, int digits) {
  char text[9];
  std::snprintf(text, sizeof text, "%0*X", digits, value);
  return text;
}

std::string to_hex(std::span<const std::byte> value) {
  std::string out;
  for (const std::byte b : value) {
    std::array<char, 4> digits;
    std::snprintf(digits.data(), digits.size(), "%02X", std::to_integer<unsigned>(b));
    out += (out.empty() ? "" : " ") + std::string(digits.data());
  }
  return out;
}

std::string to_text(od::DataType type, std::span<const std::byte> value) {
  if (type == od::DataType::visible_string) {
    return string_text(value);
  }
  if (od::byte_size(type) != value.size() || value.empty() || value.size() > 8) {
    return to_hex(value);
  }
  const std::uint64_t raw = load_le(value);
  if (type == od::DataType::boolean) {
    return raw != 0 ? "true" : "false";
  }
  if (type == od::DataType::real32) {
    return number_text(std::bit_cast<float>(static_cast<std::uint32_t>(raw)));
  }
  if (type == od::DataType::real64) {
    return number_text(std::bit_cast<double>(raw));
  }
  if (od::is_signed(type)) {
    return std::to_string(load_le_signed(value));
  }
  return od::is_integer(type) ? std::to_string(raw) : to_hex(value);
}

std::optional<double> to_number(od::DataType type, std::span<const std::byte> value) {
  if (od::byte_size(type) != value.size() || value.empty() || value.size() > 8) {
    return std::nullopt;
  }
  const std::uint64_t raw = load_le(value);
  double out = 0;
  if (type == od::DataType::real32) {
    out = std::bit_cast<float>(static_cast<std::uint32_t>(raw));
  } else if (type == od::DataType::real64) {
    out = std::bit_cast<double>(raw);
  } else if (od::is_signed(type)) {
    out = static_cast<double>(load_le_signed(value));
  } else if (type == od::DataType::boolean || od::is_integer(type)) {
    out = static_cast<double>(raw);
  } else {
    return std::nullopt;
  }
  return std::isfinite(out) ? std::optional(out) : std::nullopt;
}

std::string to_text(const image::Entry& entry, std::span<const std::byte> value) {
  const auto number = entry.scaling.is_scaled() ? image::scaled_number(entry, value) : std::nullopt;
  return number ? image::number_text(*number) : to_text(entry.type, value);
}

std::optional<double> to_number(const image::Entry& entry, std::span<const std::byte> value) {
  if (!entry.scaling.is_scaled()) {
    return to_number(entry.type, value);
  }
  const auto number = image::scaled_number(entry, value);
  return number && std::isfinite(*number) ? number : std::nullopt;
}

std::string unit_of(const image::Entry& entry) {
  return entry.scaling.unit.empty() ? std::string(image::unit_in(entry.name)) : entry.scaling.unit;
}

std::string text_with_unit(const image::Entry& entry, std::span<const std::byte> value) {
  const std::string& unit = entry.scaling.unit;
  const std::string text = to_text(entry, value);
  return unit.empty() || image::unit_in(entry.name) == unit ? text : text + ' ' + unit;
}

TypedValue typed_value(const image::Entry& entry, std::string_view text, bool raw) {
  const std::string shown = "'" + printable(std::string(text)) + "'";
  const auto beyond = [&](image::ScalingFault fault) {
    const bool low = fault == image::ScalingFault::below_low;
    const bool limit = low || fault == image::ScalingFault::above_high;
    const std::string unit = unit_of(entry);
    return shown + ' ' + std::string(image::describe(fault)) + ' ' +
           (limit ? image::number_text((low ? entry.low : entry.high).value_or(0)) +
                        (unit.empty() ? "" : ' ' + printable(unit))
                  : std::string(od::name(entry.type)));
  };
  if (!raw && entry.scaling.is_scaled()) {
    const auto number = image::parse_number(text);
    if (!number) {
      return {{}, shown + " is no number"};
    }
    TypedValue out;
    const auto fault = image::raw_of_scaled(entry, *number, out.data);
    return fault == image::ScalingFault::none ? out : TypedValue{{}, beyond(fault)};
  }
  auto data = from_text(entry.type, text);
  if (!data) {
    return {{}, shown + " is not a value of " + std::string(od::name(entry.type))};
  }
  const auto number = raw ? std::nullopt : image::raw_number(entry.type, entry.bit_length, *data);
  const auto fault = number ? image::check_limits(entry, *number) : image::ScalingFault::none;
  return fault == image::ScalingFault::none ? TypedValue{*std::move(data), {}}
                                            : TypedValue{{}, beyond(fault)};
}

std::optional<std::vector<std::byte>> from_text(od::DataType type, std::string_view text) {
  if (type == od::DataType::boolean && (text == "true" || text == "false")) {
    return little_endian(text == "true" ? 1 : 0, 1);
  }
  if (od::is_integer(type)) {
    return integer(type, text);
  }
  if (od::is_real(type)) {
    return real(type, text);
  }
  if (type == od::DataType::visible_string) {
    const auto bytes = std::as_bytes(std::span(text));
    return std::vector<std::byte>(bytes.begin(), bytes.end());
  }
  auto bytes = hex_bytes(text);
  const unsigned fixed = od::byte_size(type);
  return !bytes || fixed == 0 || bytes->size() == fixed ? bytes : std::nullopt;
}

std::optional<od::DataType> type_from_name(std::string_view text) {
  std::string lower(text);
  std::ranges::transform(lower, lower.begin(), [](unsigned char c) { return std::tolower(c); });
  using enum od::DataType;
  constexpr std::pair<std::string_view, od::DataType> kShort[] = {
      {"b", boolean},       {"i8", integer8},       {"i16", integer16},  {"i24", integer24},
      {"i32", integer32},   {"i40", integer40},     {"i48", integer48},  {"i56", integer56},
      {"i64", integer64},   {"u8", unsigned8},      {"u16", unsigned16}, {"u24", unsigned24},
      {"u32", unsigned32},  {"u40", unsigned40},    {"u48", unsigned48}, {"u56", unsigned56},
      {"u64", unsigned64},  {"r32", real32},        {"r64", real64},     {"vs", visible_string},
      {"os", octet_string}, {"us", unicode_string}, {"t", time_of_day},  {"td", time_difference},
      {"d", domain},
  };
  for (const auto& [name, type] : kShort) {
    std::string cia(od::name(type));
    std::ranges::transform(cia, cia.begin(), [](unsigned char c) { return std::tolower(c); });
    if (lower == name || lower == cia) {
      return type;
    }
  }
  return std::nullopt;
}

}  // namespace linegate::console
