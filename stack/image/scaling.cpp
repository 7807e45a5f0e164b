// SPDX-License-Identifier: Apache-2.0
#include "stack/image/scaling.h"

#include <algorithm>
#include <array>
#include <bit>
#include <charconv>
#include <limits>
#include <system_error>
#include <utility>

#include "stack/base/byte_order.h"
#include "stack/image/layout.h"

namespace linegate::image {
namespace {

constexpr int kScaledDigits = 15;  // every decimal number with so many digits is a double
constexpr double kStepTolerance = 1e-6;
constexpr double kDigitsTolerance = 1e-14;  // limits are rounded to kScaledDigits

std::uint64_t low_bits_of(std::uint64_t value, unsigned bits) {
  return bits >= 64 ? value : value & ((std::uint64_t{1} << bits) - 1);
}

std::size_t bytes_of_bits(std::uint16_t bits) {
  return (bits + 7U) / 8U;
}

void store_bits(std::uint64_t raw, std::uint16_t bits, std::vector<std::byte>& out) {
  out.resize(bytes_of_bits(bits));
  store_le(std::span(out), low_bits_of(raw, bits));
}

// number is whole. 2^(bits - 1) and 2^bits are doubles without rounding.
ScalingFault store_whole(double number, bool is_signed, std::uint16_t bits,
                         std::vector<std::byte>& out) {
  const double end = std::ldexp(1.0, is_signed ? bits - 1 : bits);
  const double begin = is_signed ? -end : 0.0;
  if (!(number >= begin && number < end)) {
    return ScalingFault::out_of_range;
  }
  store_bits(
      number < 0 ? ~static_cast<std::uint64_t>(-number) + 1 : static_cast<std::uint64_t>(number),
      bits, out);
  return ScalingFault::none;
}

ScalingFault store_real(double number, std::uint16_t bits, std::vector<std::byte>& out) {
  if (bits == 64) {
    store_bits(std::bit_cast<std::uint64_t>(number), bits, out);
    return ScalingFault::none;
  }
  if (std::isfinite(number) && std::abs(number) > std::numeric_limits<float>::max()) {
    return ScalingFault::out_of_range;
  }
  store_bits(std::bit_cast<std::uint32_t>(static_cast<float>(number)), bits, out);
  return ScalingFault::none;
}

double rounded(double number) {
  if (!std::isfinite(number)) {
    return number;
  }
  std::array<char, 32> digits{};
  const auto end = std::to_chars(digits.data(), digits.data() + digits.size(), number,
                                 std::chars_format::scientific, kScaledDigits - 1)
                       .ptr;
  double out = number;
  std::from_chars(digits.data(), end, out);
  return out == 0 ? 0.0 : out;  // no -0
}

// How far a number may be beyond a limit and is the limit nevertheless: reals have as many digits
// as their type, other numbers are far less than a step from it. Both are doubles.
double tolerance(const Entry& entry, double limit) {
  if (entry.type == od::DataType::real32) {
    return std::numeric_limits<float>::epsilon() * std::abs(limit);
  }
  const double digits = kDigitsTolerance * std::abs(limit);
  return od::is_real(entry.type) ? digits
                                 : std::max(digits, std::abs(entry.scaling.scale) * kStepTolerance);
}

}  // namespace

std::string_view unit_in(std::string_view name) {
  const std::size_t begin = name.rfind('[');
  if (!name.ends_with(']') || begin == std::string_view::npos) {
    return {};
  }
  const std::string_view unit = name.substr(begin + 1, name.size() - begin - 2);
  const bool is_number = unit.find_first_of("+-.0123456789") == 0;
  return unit.size() <= od::kLongestUnit && !is_number ? unit : std::string_view();
}

bool is_scalable(od::DataType type, std::uint16_t bits) {
  if (od::is_real(type)) {
    return od::bit_size(type) == bits;
  }
  return od::is_integer(type) && type != od::DataType::boolean && bits >= 1 && bits <= 64;
}

std::optional<double> raw_number(od::DataType type, std::uint16_t bits,
                                 std::span<const std::byte> value) {
  if (!is_scalable(type, bits) || value.size() != bytes_of_bits(bits)) {
    return std::nullopt;
  }
  const std::uint64_t raw = low_bits_of(load_le(value), bits);
  if (type == od::DataType::real32) {
    return std::bit_cast<float>(static_cast<std::uint32_t>(raw));
  }
  if (type == od::DataType::real64) {
    return std::bit_cast<double>(raw);
  }
  if (!od::is_signed(type)) {
    return static_cast<double>(raw);
  }
  const unsigned unused = 64U - bits;
  return static_cast<double>(static_cast<std::int64_t>(raw << unused) >> unused);
}

std::optional<double> scaled_number(const Entry& entry, std::span<const std::byte> value) {
  const std::optional<double> raw = raw_number(entry.type, entry.bit_length, value);
  return raw ? std::optional(rounded(*raw * entry.scaling.scale + entry.scaling.offset)) : raw;
}

std::string_view describe(ScalingFault fault) {
  switch (fault) {
    case ScalingFault::none:
      return "is possible";
    case ScalingFault::not_scalable:
      return "is of a type that is not scaled";
    case ScalingFault::out_of_range:
      return "does not fit the type";
    case ScalingFault::below_low:
      return "is below the low limit";
    case ScalingFault::above_high:
      break;
  }
  return "is above the high limit";
}

ScalingFault raw_of_scaled(const Scaling& scaling, od::DataType type, std::uint16_t bits,
                           double number, std::vector<std::byte>& out) {
  if (!is_scalable(type, bits)) {
    return ScalingFault::not_scalable;
  }
  const double raw = (number - scaling.offset) / scaling.scale;
  return od::is_real(type) ? store_real(raw, bits, out)
                           : store_whole(std::round(raw), od::is_signed(type), bits, out);
}

ScalingFault raw_of_scaled(const Entry& entry, double number, std::vector<std::byte>& out) {
  if (const ScalingFault beyond = check_limits(entry, number); beyond != ScalingFault::none) {
    return beyond;
  }
  return raw_of_scaled(entry.scaling, entry.type, entry.bit_length, number, out);
}

ScalingFault check_limits(const Entry& entry, double number) {
  // A number that is none is within no limits.
  if (entry.low && !(number >= *entry.low - tolerance(entry, *entry.low))) {
    return ScalingFault::below_low;
  }
  return entry.high && !(number <= *entry.high + tolerance(entry, *entry.high))
             ? ScalingFault::above_high
             : ScalingFault::none;
}

void describe_value(const od::VariableDescription& variable, Entry& entry) {
  entry.access = variable.access;
  entry.scaling = variable.scaling;
  if (entry.scaling.unit.empty()) {
    entry.scaling.unit = unit_in(variable.name);
  }
  const auto limit = [&entry](std::span<const std::byte> raw) {
    const auto bits = static_cast<std::uint16_t>(8 * raw.size());
    const std::optional<double> number = raw_number(entry.type, bits, raw);
    const double scaled = number.value_or(0.0) * entry.scaling.scale + entry.scaling.offset;
    return number && std::isfinite(scaled) ? std::optional(rounded(scaled)) : std::nullopt;
  };
  entry.low = limit(variable.low_limit);
  entry.high = limit(variable.high_limit);
  if (entry.scaling.scale < 0) {
    std::swap(entry.low, entry.high);
  }
}

std::string number_text(double number) {
  if (std::isnan(number)) {
    return "nan";
  }
  if (std::isinf(number)) {
    return number < 0 ? "-inf" : "inf";
  }
  std::array<char, 32> digits{};
  const auto end = std::to_chars(digits.data(), digits.data() + digits.size(), rounded(number)).ptr;
  return {digits.data(), end};
}

std::string meaning_text(const Scaling& scaling, const std::optional<double>& low,
                         const std::optional<double>& high) {
  std::string out;
  const auto add = [&out](const std::string& part) { out += (out.empty() ? "" : ", ") + part; };
  if (scaling.is_scaled()) {
    std::string formula = "raw * " + number_text(scaling.scale);
    if (scaling.offset < 0 || scaling.offset > 0) {
      formula += (scaling.offset < 0 ? " - " : " + ") + number_text(std::abs(scaling.offset));
    }
    add(formula);
  }
  if (!scaling.unit.empty()) {
    add("in " + scaling.unit);
  }
  if (low && high) {
    add(number_text(*low) + " to " + number_text(*high));
  } else if (low || high) {
    add((low ? "at least " : "at most ") + number_text(low ? *low : *high));
  }
  return out;
}

std::optional<double> parse_number(std::string_view text) {
  if (text.starts_with("0x") || text.starts_with("0X")) {
    std::uint64_t value = 0;
    const auto [end, error] =
        std::from_chars(text.data() + 2, text.data() + text.size(), value, 16);
    return error == std::errc{} && end == text.data() + text.size() && text.size() > 2
               ? std::optional(static_cast<double>(value))
               : std::nullopt;
  }
  text.remove_prefix(text.starts_with('+') ? 1 : 0);
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  return !text.empty() && error == std::errc{} && end == text.data() + text.size()
             ? std::optional(value)
             : std::nullopt;
}

}  // namespace linegate::image
