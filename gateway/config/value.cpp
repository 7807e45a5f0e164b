// SPDX-License-Identifier: Apache-2.0
#include "gateway/config/value.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cctype>
#include <charconv>
#include <cmath>
#include <limits>

#include "stack/od/description.h"

namespace linegate::config {
namespace {

struct Unit {
  std::string_view name;
  std::int64_t factor;
};

constexpr std::int64_t kSecond = 1'000'000'000;
constexpr std::array<Unit, 6> kTimes{{{"ns", 1},
                                      {"us", 1000},
                                      {"ms", 1'000'000},
                                      {"s", kSecond},
                                      {"min", 60 * kSecond},
                                      {"h", 3600 * kSecond}}};
constexpr std::int64_t kTerabyte = 1'000'000'000'000;
constexpr std::array<Unit, 5> kSizes{
    {{"B", 1}, {"kB", 1000}, {"MB", 1'000'000}, {"GB", 1'000'000'000}, {"TB", kTerabyte}}};
constexpr std::array<Unit, 3> kRates{{{"bit", 1}, {"kbit", 1000}, {"Mbit", 1'000'000}}};
constexpr std::int64_t kDay = 24 * 3600 * kSecond;

// A number and its unit: "1.5" and "ms".
struct Split {
  std::string_view number;
  std::string_view unit;
};

Split split_unit(std::string_view text) {
  std::size_t i = 0;
  while (i < text.size() &&
         (std::isdigit(static_cast<unsigned char>(text[i])) != 0 || text[i] == '.')) {
    ++i;
  }
  Split split{text.substr(0, i), text.substr(i)};
  while (!split.unit.empty() && split.unit.front() == ' ') {
    split.unit.remove_prefix(1);
  }
  return split;
}

template <std::size_t N>
std::optional<std::int64_t> scaled(const Split& split, const std::array<Unit, N>& units,
                                   std::int64_t highest) {
  const auto unit =
      std::find_if(units.begin(), units.end(), [&](const Unit& u) { return u.name == split.unit; });
  double number = 0;
  const char* end = split.number.data() + split.number.size();
  const auto parsed = std::from_chars(split.number.data(), end, number, std::chars_format::fixed);
  if (unit == units.end() || parsed.ec != std::errc{} || parsed.ptr != end) {
    return std::nullopt;
  }
  const double value = number * static_cast<double>(unit->factor);
  if (!(value <= static_cast<double>(highest))) {
    return std::nullopt;
  }
  return std::llround(value);
}

// Magnitude and sign of an integer; hexadecimal with 0x.
struct Number {
  bool negative = false;
  std::uint64_t magnitude = 0;
};

std::optional<Number> parse_number(std::string_view text) {
  Number number;
  if (!text.empty() && (text.front() == '-' || text.front() == '+')) {
    number.negative = text.front() == '-';
    text.remove_prefix(1);
  }
  int base = 10;
  if (text.size() > 2 && text[0] == '0' && (text[1] == 'x' || text[1] == 'X')) {
    text.remove_prefix(2);
    base = 16;
  }
  const char* end = text.data() + text.size();
  const auto parsed = std::from_chars(text.data(), end, number.magnitude, base);
  if (text.empty() || parsed.ec != std::errc{} || parsed.ptr != end) {
    return std::nullopt;
  }
  return number;
}

std::optional<std::vector<std::byte>> integer_value(std::string_view text, od::DataType type) {
  const unsigned bits = od::bit_size(type);
  if (type == od::DataType::boolean && (text == "true" || text == "false")) {
    return little_endian(text == "true" ? 1 : 0, 1);
  }
  const auto number = parse_number(text);
  if (!number) {
    return std::nullopt;
  }
  const std::uint64_t all =
      bits >= 64 ? std::numeric_limits<std::uint64_t>::max() : (std::uint64_t{1} << bits) - 1;
  const std::uint64_t half = all / 2;
  // Hexadecimal values are bit patterns: they may use the sign bit.
  const bool pattern = text.find('x') != std::string_view::npos;
  const std::uint64_t highest = od::is_signed(type) && !pattern ? half : all;
  if (number->negative ? !od::is_signed(type) || number->magnitude > half + 1
                       : number->magnitude > highest) {
    return std::nullopt;
  }
  const std::uint64_t raw = number->negative ? 0 - number->magnitude : number->magnitude;
  return little_endian(raw, od::byte_size(type));
}

std::optional<std::vector<std::byte>> real_value(std::string_view text, od::DataType type) {
  double number = 0;
  const auto parsed = std::from_chars(text.data(), text.data() + text.size(), number);
  if (parsed.ec != std::errc{} || parsed.ptr != text.data() + text.size()) {
    return std::nullopt;
  }
  if (type == od::DataType::real64) {
    return little_endian(std::bit_cast<std::uint64_t>(number), 8);
  }
  if (std::isfinite(number) && std::abs(number) > std::numeric_limits<float>::max()) {
    return std::nullopt;
  }
  return little_endian(std::bit_cast<std::uint32_t>(static_cast<float>(number)), 4);
}

std::optional<std::vector<std::byte>> hexadecimal_bytes(std::string_view text) {
  std::string digits;
  for (const char c : text) {
    if (std::isxdigit(static_cast<unsigned char>(c)) != 0) {
      digits += c;
    } else if (c != ' ') {
      return std::nullopt;
    }
  }
  if (digits.size() % 2 != 0) {
    return std::nullopt;
  }
  std::vector<std::byte> out;
  for (std::size_t i = 0; i < digits.size(); i += 2) {
    unsigned value = 0;
    std::from_chars(digits.data() + i, digits.data() + i + 2, value, 16);
    out.push_back(static_cast<std::byte>(value));
  }
  return out;
}

char lower(char c) {
  return static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
}

// Edit distance: insertions, deletions, replacements and swaps of neighbours, in any case.
std::size_t distance(std::string_view a, std::string_view b) {
  std::vector<std::size_t> older(b.size() + 1);
  std::vector<std::size_t> above(b.size() + 1);
  std::vector<std::size_t> row(b.size() + 1);
  for (std::size_t j = 0; j <= b.size(); ++j) {
    row[j] = j;
  }
  for (std::size_t i = 1; i <= a.size(); ++i) {
    older.swap(above);
    above.swap(row);
    row[0] = i;
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const bool same = lower(a[i - 1]) == lower(b[j - 1]);
      row[j] = std::min({above[j] + 1, row[j - 1] + 1, above[j - 1] + (same ? 0U : 1U)});
      if (i > 1 && j > 1 && lower(a[i - 1]) == lower(b[j - 2]) &&
          lower(a[i - 2]) == lower(b[j - 1])) {
        row[j] = std::min(row[j], older[j - 2] + 1);
      }
    }
  }
  return row[b.size()];
}

}  // namespace

std::vector<std::byte> little_endian(std::uint64_t value, std::size_t size) {
  std::vector<std::byte> out(size);
  for (auto& byte : out) {
    byte = static_cast<std::byte>(value & 0xFFU);
    value >>= 8U;
  }
  return out;
}

std::optional<Duration> parse_duration(std::string_view text) {
  if (text == "0") {
    return Duration::zero();
  }
  const auto ns = scaled(split_unit(text), kTimes, kDay);
  return ns ? std::optional(Duration(*ns)) : std::nullopt;
}

std::string format_duration(Duration duration) {
  if (duration == Duration::zero()) {
    return "0";
  }
  for (const auto& unit : {kTimes[3], kTimes[2], kTimes[1]}) {
    if (duration.count() % unit.factor == 0) {
      return std::to_string(duration.count() / unit.factor) + std::string(unit.name);
    }
  }
  return std::to_string(duration.count()) + "ns";
}

std::optional<std::uint32_t> parse_bit_rate(std::string_view text) {
  Split split = split_unit(text);
  if (split.unit.ends_with("/s")) {
    split.unit.remove_suffix(2);
  }
  const auto rate = scaled(split, kRates, 8'000'000);
  return rate && *rate > 0 ? std::optional(static_cast<std::uint32_t>(*rate)) : std::nullopt;
}

std::optional<std::uint64_t> parse_size(std::string_view text) {
  const auto size = scaled(split_unit(text), kSizes, kTerabyte);
  return size ? std::optional(static_cast<std::uint64_t>(*size)) : std::nullopt;
}

std::string format_size(std::uint64_t bytes) {
  constexpr std::array<std::string_view, 5> kUnits{"B", "kB", "MB", "GB", "TB"};
  std::size_t unit = 0;
  for (; unit + 1 < kUnits.size() && bytes != 0 && bytes % 1000 == 0; ++unit) {
    bytes /= 1000;
  }
  return std::to_string(bytes) + std::string(kUnits[unit]);
}

std::optional<Duration> parse_age(std::string_view text) {
  constexpr std::int64_t kHoursOfADay = 24;
  constexpr std::uint64_t kMostHours = 100 * 366 * kHoursOfADay;
  const bool days = text.ends_with('d');
  if (days || text.ends_with('h')) {
    const auto number = parse_unsigned(text.substr(0, text.size() - 1));
    const std::uint64_t hours_each = days ? kHoursOfADay : 1;
    if (!number || *number == 0 || *number > kMostHours / hours_each) {
      return std::nullopt;
    }
    return std::chrono::hours(static_cast<std::int64_t>(*number * hours_each));
  }
  const auto duration = parse_duration(text);
  return duration && *duration >= std::chrono::minutes(1) ? duration : std::nullopt;
}

std::string format_age(Duration age) {
  constexpr Duration kDayLong = std::chrono::hours(24);
  constexpr Duration kHourLong = std::chrono::hours(1);
  if (age >= kHourLong && age % kHourLong == Duration::zero()) {
    return age % kDayLong == Duration::zero() ? std::to_string(age / kDayLong) + "d"
                                              : std::to_string(age / kHourLong) + "h";
  }
  return format_duration(age);
}

std::optional<std::uint64_t> parse_unsigned(std::string_view text) {
  const auto number = parse_number(text);
  return number && !number->negative ? std::optional(number->magnitude) : std::nullopt;
}

std::optional<od::Address> parse_address(std::string_view text) {
  return od::parse_address(text);
}

std::string format_address(od::Address address) {
  return od::to_text(address);
}

std::string_view other_reading(std::string_view name,
                               const std::function<bool(std::uint16_t index)>& exists) {
  if (name == "*") {
    return "all objects";
  }
  const auto address = parse_address(name);
  return address && (name.find(':') != std::string_view::npos || exists(address->index))
             ? "an object, INDEX:SUB"
             : "";
}

std::optional<std::vector<std::byte>> parse_value(std::string_view text, od::DataType type) {
  if (od::is_integer(type)) {
    return integer_value(text, type);
  }
  if (od::is_real(type)) {
    return real_value(text, type);
  }
  if (type == od::DataType::visible_string) {
    const auto* raw = reinterpret_cast<const std::byte*>(text.data());
    return std::vector<std::byte>(raw, raw + text.size());
  }
  auto bytes = hexadecimal_bytes(text);
  const unsigned fixed = od::byte_size(type);
  return !bytes || fixed == 0 || bytes->size() == fixed ? bytes : std::nullopt;
}

std::string nearest(std::string_view text, std::span<const std::string> candidates) {
  std::string best;
  std::size_t least = std::max<std::size_t>(1, std::min<std::size_t>(3, text.size() / 3)) + 1;
  for (const auto& candidate : candidates) {
    const std::size_t d = distance(text, candidate);
    if (d < least) {
      least = d;
      best = candidate;
    }
  }
  return best;
}

}  // namespace linegate::config
