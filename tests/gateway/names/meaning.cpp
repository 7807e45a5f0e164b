// SPDX-License-Identifier: Apache-2.0
#include "tests/gateway/names/meaning.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdio>
#include <vector>

namespace linegate::names {
namespace {

using od::DataType;

constexpr std::int64_t kNsOfDay = 86'400'000'000'000;
constexpr std::int64_t kDaysTo1984 = 5'113;

void add_utf8(std::uint32_t code, std::string& to) {
  const auto add = [&](std::uint32_t octet) { to += static_cast<char>(octet); };
  if (code >= 0x1'0000) {
    add(0xF0 | code / 0x4'0000);
    add(0x80 | code / 0x1000 % 0x40);
    add(0x80 | code / 0x40 % 0x40);
    add(0x80 | code % 0x40);
  } else if (code >= 0x800) {
    add(0xE0 | code / 0x1000);
    add(0x80 | code / 0x40 % 0x40);
    add(0x80 | code % 0x40);
  } else if (code >= 0x80) {
    add(0xC0 | code / 0x40);
    add(0x80 | code % 0x40);
  } else {
    add(code);
  }
}

std::string latin1(std::uint64_t raw, unsigned bits) {
  std::string out = "'";
  for (unsigned i = 0; i < bits / 8 && (raw >> 8 * i & 0xFF) != 0; ++i)
    add_utf8(raw >> 8 * i & 0xFF, out);
  return out;
}

std::string utf16(std::uint64_t raw, unsigned bits) {
  std::vector<std::uint32_t> units;
  for (unsigned i = 0; i < bits / 16 && (raw >> 16 * i & 0xFFFF) != 0; ++i)
    units.push_back(raw >> 16 * i & 0xFFFF);
  units.push_back(0);
  std::string out = "'";
  for (std::size_t i = 0; i + 1 < units.size(); ++i) {
    const std::uint32_t kind = units[i] / 0x400;  // 36h: the first of a pair, 37h: the second one
    if (kind == 0x36 && units[i + 1] / 0x400 == 0x37) {
      add_utf8(0x1'0000 + units[i] % 0x400 * 0x400 + units[i + 1] % 0x400, out);
      ++i;
    } else {
      add_utf8(kind == 0x36 || kind == 0x37 ? 0xFFFD : units[i], out);
    }
  }
  return out;
}

std::string signed_text(std::uint64_t raw, unsigned bits) {
  if (raw >> (bits - 1) == 0)
    return std::to_string(raw);
  const std::uint64_t magnitude = ~raw + 1;  // modulo 2^bits
  return "-" + std::to_string(bits == 64 ? magnitude : magnitude % (std::uint64_t{1} << bits));
}

std::string time_text(std::uint64_t raw, std::int64_t epoch) {
  const auto ms = static_cast<std::int64_t>(raw % 0x1000'0000);
  const auto days = static_cast<std::int64_t>(raw / 0x1'0000'0000);
  return std::to_string((days + epoch) * kNsOfDay + ms * 1'000'000);
}

}  // namespace

std::string text_of(double value) {
  if (std::isnan(value))
    return "nan";
  std::array<char, 20> digits{};
  std::snprintf(digits.data(), digits.size(), "%016llX",
                static_cast<unsigned long long>(std::bit_cast<std::uint64_t>(value)));
  return digits.data();
}

std::string hex(std::span<const std::uint8_t> octets) {
  std::string out = "x";
  for (const std::uint8_t octet : octets) {
    out += "0123456789ABCDEF"[octet / 16];
    out += "0123456789ABCDEF"[octet % 16];
  }
  return out;
}

const CiaType& cia_type(DataType type) {
  return *std::ranges::find(kCiaTypes, type, &CiaType::type);
}

std::string meaning(DataType type, unsigned bits, std::uint64_t raw) {
  switch (type) {
    case DataType::boolean:
      return raw % 2 != 0 ? "true" : "false";
    case DataType::real32:
      return text_of(std::bit_cast<float>(static_cast<std::uint32_t>(raw)));
    case DataType::real64:
      return text_of(std::bit_cast<double>(raw));
    case DataType::visible_string:
      return latin1(raw, bits);
    case DataType::unicode_string:
      return utf16(raw, bits);
    case DataType::time_of_day:
      return time_text(raw, kDaysTo1984);
    case DataType::time_difference:
      return time_text(raw, 0);
    case DataType::octet_string:
    case DataType::domain: {
      std::vector<std::uint8_t> octets;
      for (unsigned i = 0; i < bits; i += 8)
        octets.push_back(static_cast<std::uint8_t>(raw >> i));
      return hex(octets);
    }
    default:
      return cia_type(type).number == Number::negative_too ? signed_text(raw, bits)
                                                           : std::to_string(raw);
  }
}

}  // namespace linegate::names
