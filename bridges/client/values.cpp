// SPDX-License-Identifier: Apache-2.0
#include "bridges/client/values.h"

#include <algorithm>
#include <array>
#include <bit>
#include <charconv>
#include <cmath>
#include <limits>
#include <optional>
#include <string_view>
#include <type_traits>
#include <utility>

#include "stack/base/byte_order.h"
#include "stack/base/utf8.h"
#include "stack/image/scaling.h"
#include "stack/od/data_type.h"

namespace linegate::client {
namespace {

constexpr std::int64_t kNsPerMs = 1'000'000;
constexpr std::int64_t kMsPerDay = 86'400'000;
// 1984-01-01, where TIME_OF_DAY begins (CiA 301 7.1.6.7), after 1970-01-01.
constexpr std::int64_t kEpochDays = 5'113;
constexpr std::uint16_t kTimeBits = 48;

std::uint64_t low_bits(std::uint64_t value, unsigned bits) {
  return bits >= 64 ? value : value & ((std::uint64_t{1} << bits) - 1);
}

std::int64_t sign_extended(std::uint64_t value, unsigned bits) {
  const unsigned unused = 64U - bits;
  return static_cast<std::int64_t>(value << unused) >> unused;
}

// VISIBLE_STRING; octets above 7Fh as in Latin-1, as in named topics.
std::string from_latin1(std::span<const std::byte> value) {
  std::string out;
  for (const std::byte octet : value) {
    if (octet == std::byte{0})
      break;
    append_utf8(std::to_integer<std::uint32_t>(octet), out);
  }
  return out;
}

// UNICODE_STRING is UTF-16 (CiA 301 7.1.6.6); half a pair of surrogates becomes U+FFFD.
std::string from_utf16(std::span<const std::byte> value) {
  std::string out;
  for (std::size_t i = 0; i + 1 < value.size(); i += 2) {
    std::uint32_t c = load_le<std::uint16_t>(value.data() + i);
    if (c == 0)
      break;
    if (c >= 0xD800 && c < 0xE000) {
      const std::uint32_t low =
          i + 3 < value.size() ? load_le<std::uint16_t>(value.data() + i + 2) : 0U;
      if (c < 0xDC00 && low >= 0xDC00 && low < 0xE000) {
        c = 0x10000 + ((c - 0xD800) << 10U) + (low - 0xDC00);
        i += 2;
      } else {
        c = 0xFFFD;
      }
    }
    append_utf8(c, out);
  }
  return out;
}

std::vector<std::byte> little_endian(std::uint64_t value, std::uint16_t bits) {
  std::vector<std::byte> out((bits + 7U) / 8U);
  for (std::size_t i = 0; i < out.size(); ++i)
    out[i] = i < 8 ? static_cast<std::byte>(value >> (8 * i)) : std::byte{0};
  return out;
}

std::int64_t time_ns(std::uint64_t raw, bool since_1984) {
  const auto ms = static_cast<std::int64_t>(raw & 0x0FFF'FFFF);
  const auto days = static_cast<std::int64_t>(raw >> 32U & 0xFFFF);
  return ((days + (since_1984 ? kEpochDays : 0)) * kMsPerDay + ms) * kNsPerMs;
}

// An integer of any kind as sign and magnitude.
struct Whole {
  bool negative = false;
  std::uint64_t magnitude = 0;
};

std::optional<Whole> whole(const Data& data) {
  if (const auto* const b = std::get_if<bool>(&data))
    return Whole{false, *b ? 1U : 0U};
  if (const auto* const u = std::get_if<std::uint64_t>(&data))
    return Whole{false, *u};
  if (const auto* const i = std::get_if<std::int64_t>(&data)) {
    const auto bits = static_cast<std::uint64_t>(*i);
    return Whole{*i < 0, *i < 0 ? ~bits + 1 : bits};
  }
  const auto* const d = std::get_if<double>(&data);
  constexpr double kEnd = 18'446'744'073'709'551'616.0;  // 2^64
  if (d == nullptr || std::trunc(*d) != *d || std::abs(*d) >= kEnd)
    return std::nullopt;
  return Whole{*d < 0, static_cast<std::uint64_t>(std::abs(*d))};
}

bool is_number(const Data& data) {
  return std::holds_alternative<bool>(data) || std::holds_alternative<std::int64_t>(data) ||
         std::holds_alternative<std::uint64_t>(data) || std::holds_alternative<double>(data);
}

std::optional<double> number_of(const Data& data) {
  return std::visit(
      [](const auto& value) -> std::optional<double> {
        if constexpr (std::is_arithmetic_v<std::remove_cvref_t<decltype(value)>>)
          return static_cast<double>(value);
        else
          return std::nullopt;
      },
      data);
}

Error encode_integer(const Data& data, bool is_signed, std::uint16_t bits,
                     std::vector<std::byte>& out) {
  if (!is_number(data))
    return Error::wrong_type;
  const auto number = whole(data);
  if (!number)
    return Error::out_of_range;
  const std::uint64_t top = std::uint64_t{1} << (bits - 1U);
  const std::uint64_t most = is_signed ? (number->negative ? top : top - 1) : top - 1 + top;
  const bool fits =
      number->magnitude <= most && (is_signed || !number->negative || number->magnitude == 0);
  if (!fits)
    return Error::out_of_range;
  out = little_endian(low_bits(number->negative ? ~number->magnitude + 1 : number->magnitude, bits),
                      bits);
  return Error::none;
}

Error encode_real(const Data& data, std::uint16_t bits, std::vector<std::byte>& out) {
  if (!is_number(data))
    return Error::wrong_type;
  double value = 0;
  if (const auto* const d = std::get_if<double>(&data)) {
    value = *d;
  } else {
    const auto number = whole(data);
    value = static_cast<double>(number->magnitude) * (number->negative ? -1 : 1);
  }
  if (bits == 64) {
    out = little_endian(std::bit_cast<std::uint64_t>(value), 64);
    return Error::none;
  }
  if (std::isfinite(value) && std::abs(value) > std::numeric_limits<float>::max())
    return Error::out_of_range;
  out = little_endian(std::bit_cast<std::uint32_t>(static_cast<float>(value)), 32);
  return Error::none;
}

Error encode_time(const Data& data, bool since_1984, std::vector<std::byte>& out) {
  const auto number = is_number(data) ? whole(data) : std::nullopt;
  if (!number)
    return is_number(data) ? Error::out_of_range : Error::wrong_type;
  const std::uint64_t ms = number->magnitude / static_cast<std::uint64_t>(kNsPerMs);
  const auto epoch = static_cast<std::uint64_t>(since_1984 ? kEpochDays : 0);
  const std::uint64_t days = ms / static_cast<std::uint64_t>(kMsPerDay);
  if (number->negative || days < epoch || days - epoch > 0xFFFF)
    return Error::out_of_range;
  out =
      little_endian((days - epoch) << 32U | ms % static_cast<std::uint64_t>(kMsPerDay), kTimeBits);
  return Error::none;
}

// A shorter text ends with zeros, so it cannot have one.
Error encode_text(std::string_view text, bool is_wide, std::uint16_t bits,
                  std::vector<std::byte>& out) {
  std::vector<std::byte> units;
  const auto put = [&](std::uint32_t unit) {
    units.push_back(static_cast<std::byte>(unit));
    if (is_wide)
      units.push_back(static_cast<std::byte>(unit >> 8U));
  };
  while (!text.empty() && units.size() <= bits / 8U) {
    const auto code = take_code_point(text);
    if (!code || *code == 0 || (!is_wide && *code > 0xFF))
      return Error::out_of_range;
    if (*code > 0xFFFF) {
      put(0xD800 + ((*code - 0x1'0000) >> 10U));
      put(0xDC00 + ((*code - 0x1'0000) & 0x3FFU));
    } else {
      put(*code);
    }
  }
  if (units.size() > bits / 8U)
    return Error::out_of_range;
  units.resize(bits / 8U);
  out = std::move(units);
  return Error::none;
}

Error encode_bytes(const Data& data, std::uint16_t bits, std::vector<std::byte>& out) {
  if (const auto* const text = std::get_if<std::string>(&data)) {
    const auto bytes = std::as_bytes(std::span(*text));
    out.assign(bytes.begin(), bytes.end());
  } else if (const auto* const bytes = std::get_if<std::vector<std::byte>>(&data)) {
    out = *bytes;
  } else {
    return Error::wrong_type;
  }
  const std::size_t size = (bits + 7U) / 8U;
  const bool is_text = std::holds_alternative<std::string>(data);
  if (out.size() > size || (!is_text && out.size() != size))
    return Error::out_of_range;
  out.resize(size);  // a shorter text ends with 0
  const bool fits = bits % 8 == 0 || (out.back() >> (bits % 8)) == std::byte{0};
  return fits ? Error::none : Error::out_of_range;
}

bool is_time(od::DataType type, std::uint16_t bits) {
  return (type == od::DataType::time_of_day || type == od::DataType::time_difference) &&
         bits == kTimeBits;
}

bool is_real(od::DataType type, std::uint16_t bits) {
  return (type == od::DataType::real32 && bits == 32) ||
         (type == od::DataType::real64 && bits == 64);
}

bool is_text(od::DataType type, std::uint16_t bits) {
  return (type == od::DataType::visible_string && bits % 8 == 0) ||
         (type == od::DataType::unicode_string && bits % 16 == 0);
}

bool is_whole(od::DataType type, std::uint16_t bits) {
  return od::is_integer(type) && bits >= 1 && bits <= 64;
}

}  // namespace

std::vector<std::byte> bits_of(std::span<const std::byte> area, std::uint32_t bit_offset,
                               std::uint16_t bit_length) {
  if (std::uint64_t{bit_offset} + bit_length > std::uint64_t{area.size()} * 8)
    return {};
  std::vector<std::byte> out((bit_length + 7U) / 8U);
  if (bit_offset % 8 == 0 && bit_length % 8 == 0) {
    std::copy_n(area.begin() + bit_offset / 8, out.size(), out.begin());
    return out;
  }
  for (std::uint32_t i = 0; i < bit_length; ++i) {
    const std::uint32_t from = bit_offset + i;
    const unsigned bit = std::to_integer<unsigned>(area[from / 8]) >> (from % 8) & 1U;
    out[i / 8] |= static_cast<std::byte>(bit << (i % 8));
  }
  return out;
}

Data decode(od::DataType type, std::uint16_t bits, std::span<const std::byte> value) {
  if (value.size() != (bits + 7U) / 8U || value.empty())
    return {};
  if (is_whole(type, bits)) {
    const std::uint64_t raw = low_bits(load_le(value), bits);
    if (type == od::DataType::boolean)
      return raw != 0;
    return od::is_signed(type) ? Data(sign_extended(raw, bits)) : Data(raw);
  }
  if (is_real(type, bits)) {
    const std::uint64_t raw = load_le(value);
    return bits == 64 ? std::bit_cast<double>(raw)
                      : double{std::bit_cast<float>(static_cast<std::uint32_t>(raw))};
  }
  if (is_time(type, bits))
    return time_ns(load_le(value), type == od::DataType::time_of_day);
  if (is_text(type, bits))
    return type == od::DataType::unicode_string ? from_utf16(value) : from_latin1(value);
  return std::vector<std::byte>(value.begin(), value.end());
}

Error encode(const Data& value, od::DataType type, std::uint16_t bits,
             std::vector<std::byte>& out) {
  if (bits == 0)
    return Error::wrong_type;
  if (is_whole(type, bits)) {
    if (type == od::DataType::boolean) {  // in a byte, too: 0 and 1
      const Error error = encode_integer(value, false, 1, out);
      out.resize((bits + 7U) / 8U);
      return error;
    }
    return encode_integer(value, od::is_signed(type), bits, out);
  }
  if (is_real(type, bits))
    return encode_real(value, bits, out);
  if (is_time(type, bits))
    return encode_time(value, type == od::DataType::time_of_day, out);
  const bool is_wide = type == od::DataType::unicode_string;
  const auto* const text = std::get_if<std::string>(&value);
  if (text != nullptr && (is_wide || type == od::DataType::visible_string))
    return is_text(type, bits) ? encode_text(*text, is_wide, bits, out) : Error::wrong_type;
  return encode_bytes(value, bits, out);
}

Data scaled(const image::Entry& entry, const Data& raw, std::span<const std::byte> value) {
  const auto number = entry.scaling.is_scaled() ? image::scaled_number(entry, value) : std::nullopt;
  return number ? Data(*number) : raw;
}

Error encode_scaled(const Data& value, const image::Entry& entry, std::vector<std::byte>& out) {
  const std::optional<double> number = number_of(value);
  const bool scales = entry.scaling.is_scaled() && image::is_scalable(entry.type, entry.bit_length);
  if (scales && !number)
    return Error::wrong_type;
  if (scales)
    return image::raw_of_scaled(entry, *number, out) == image::ScalingFault::none
               ? Error::none
               : Error::out_of_range;
  if (number && image::check_limits(entry, *number) != image::ScalingFault::none)
    return Error::out_of_range;
  return encode(value, entry.type, entry.bit_length, out);
}

std::string text_of(const Data& data) {
  struct Text {
    std::string operator()(std::monostate) const { return {}; }
    std::string operator()(bool value) const { return value ? "true" : "false"; }
    std::string operator()(std::int64_t value) const { return std::to_string(value); }
    std::string operator()(std::uint64_t value) const { return std::to_string(value); }
    std::string operator()(double value) const {
      // As the console: 100000 rather than 1e+05.
      const double size = std::abs(value);
      const bool plain = value == 0 || (size >= 1e-4 && size < 1e16);
      std::array<char, 64> digits{};
      const auto end =
          std::to_chars(digits.data(), digits.data() + digits.size(), value,
                        plain ? std::chars_format::fixed : std::chars_format::scientific)
              .ptr;
      return {digits.data(), end};
    }
    std::string operator()(const std::string& value) const { return value; }
    std::string operator()(const std::vector<std::byte>& value) const {
      constexpr std::string_view kDigits = "0123456789ABCDEF";
      std::string out;
      for (const std::byte b : value) {
        out += out.empty() ? "" : " ";
        out += kDigits[std::to_integer<std::size_t>(b >> 4)];
        out += kDigits[std::to_integer<std::size_t>(b & std::byte{15})];
      }
      return out;
    }
  };
  return std::visit(Text{}, data);
}

std::string Value::text() const {
  return text_of(data);
}

bool Snapshot::good() const {
  return std::ranges::all_of(values, &Value::good);
}

bool is_same(const Data& a, const Data& b) {
  const auto* const left = std::get_if<double>(&a);
  const auto* const right = std::get_if<double>(&b);
  if (left != nullptr && right != nullptr)
    return std::bit_cast<std::uint64_t>(*left) == std::bit_cast<std::uint64_t>(*right);
  return a == b;
}

}  // namespace linegate::client
