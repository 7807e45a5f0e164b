// SPDX-License-Identifier: Apache-2.0
#include "stack/image/scaling.h"

#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <random>

#include <gtest/gtest.h>

#include "stack/base/byte_order.h"
#include "stack/image/layout.h"

namespace linegate::image {
namespace {

using od::DataType;

Entry entry_of(DataType type, std::uint16_t bits, double scale, double offset = 0) {
  Entry entry;
  entry.type = type;
  entry.bit_length = bits;
  entry.scaling = {.unit = "bar", .scale = scale, .offset = offset};
  return entry;
}

std::vector<std::byte> bytes_of(std::uint64_t raw, std::uint16_t bits) {
  std::vector<std::byte> out((bits + 7U) / 8U);
  store_le(std::span(out), bits == 64 ? raw : raw & ((std::uint64_t{1} << bits) - 1));
  return out;
}

double shown(const Entry& entry, std::uint64_t raw) {
  return scaled_number(entry, bytes_of(raw, entry.bit_length)).value();
}

std::uint64_t written(const Entry& entry, double number) {
  std::vector<std::byte> out;
  EXPECT_EQ(raw_of_scaled(entry, number, out), ScalingFault::none) << number;
  EXPECT_EQ(out.size(), (entry.bit_length + 7U) / 8U);
  return load_le(std::span<const std::byte>(out));
}

ScalingFault fault(const Entry& entry, double number) {
  std::vector<std::byte> out{std::byte{7}};
  const ScalingFault why = raw_of_scaled(entry, number, out);
  EXPECT_EQ(out, (std::vector{std::byte{7}})) << "a refused value changes nothing";
  return why;
}

TEST(Scaling, IsRawTimesScalePlusOffset) {
  const Entry pressure = entry_of(DataType::unsigned16, 16, 0.1, -40);
  EXPECT_EQ(shown(pressure, 523), 12.3);
  EXPECT_EQ(shown(pressure, 0), -40);
  EXPECT_EQ(written(pressure, 12.3), 523U);
  EXPECT_EQ(written(pressure, 12.34), 523U) << "the nearest raw value";
  const Entry level = entry_of(DataType::integer8, 8, -0.5);
  EXPECT_EQ(shown(level, 0xFF), 0.5);
  EXPECT_EQ(written(level, 64), 0x80U);
  const Entry speed = entry_of(DataType::real32, 32, 60);
  EXPECT_EQ(shown(speed, 0x3FC00000), 90);
  EXPECT_EQ(written(speed, 90), 0x3FC00000U);
}

TEST(Scaling, ShowsFewDigits) {
  const Entry tenths = entry_of(DataType::unsigned32, 32, 0.1);
  for (std::uint64_t raw = 0; raw < 1000; ++raw) {
    const std::string text = number_text(shown(tenths, raw));
    EXPECT_EQ(text,
              std::to_string(raw / 10) + (raw % 10 == 0 ? "" : "." + std::to_string(raw % 10)));
  }
}

TEST(Scaling, RefusesWhatDoesNotFitTheRawValue) {
  const Entry byte = entry_of(DataType::unsigned8, 8, 0.1);
  EXPECT_EQ(written(byte, 25.5), 255U);
  EXPECT_EQ(fault(byte, 25.6), ScalingFault::out_of_range);
  EXPECT_EQ(fault(byte, -0.1), ScalingFault::out_of_range);
  EXPECT_EQ(fault(byte, std::nan("")), ScalingFault::out_of_range);
  EXPECT_EQ(fault(byte, std::numeric_limits<double>::infinity()), ScalingFault::out_of_range);
  const Entry cut = entry_of(DataType::unsigned16, 10, 1, 1);  // a PDO carries 10 of its bits
  EXPECT_EQ(written(cut, 1024), 1023U);
  EXPECT_EQ(fault(cut, 1025), ScalingFault::out_of_range);
  const Entry large = entry_of(DataType::unsigned64, 64, 2);
  EXPECT_EQ(fault(large, std::ldexp(1.0, 65)), ScalingFault::out_of_range);
  const Entry low = entry_of(DataType::integer64, 64, 2);
  EXPECT_EQ(written(low, -std::ldexp(1.0, 64)), std::uint64_t{1} << 63U);
  EXPECT_EQ(fault(low, std::ldexp(1.0, 64)), ScalingFault::out_of_range);
  EXPECT_EQ(fault(entry_of(DataType::real32, 32, 1e-30), 1e30), ScalingFault::out_of_range);
  EXPECT_EQ(fault(entry_of(DataType::boolean, 1, 2), 1), ScalingFault::not_scalable);
  EXPECT_EQ(fault(entry_of(DataType::visible_string, 32, 2), 1), ScalingFault::not_scalable);
}

TEST(Scaling, LimitsAreThoseOfTheDescription) {
  od::VariableDescription variable;
  variable.type = DataType::integer16;
  variable.name = "Pressure [bar]";
  variable.access = od::Access::rww;
  variable.scaling = {.unit = "", .scale = -0.1, .offset = 5};
  variable.low_limit = bytes_of(0xFFF6, 16);  // -10
  variable.high_limit = bytes_of(20, 16);
  Entry entry;
  entry.type = variable.type;
  entry.bit_length = 16;
  describe_value(variable, entry);
  EXPECT_EQ(entry.access, od::Access::rww);
  EXPECT_EQ(entry.scaling.unit, "bar");
  EXPECT_EQ(entry.low, 3);  // a scale below 0 turns them
  EXPECT_EQ(entry.high, 6);
  EXPECT_EQ(written(entry, 3), 20U);
  EXPECT_EQ(written(entry, 6), 0xFFF6U);
  EXPECT_EQ(fault(entry, 2.9), ScalingFault::below_low);
  EXPECT_EQ(fault(entry, 6.1), ScalingFault::above_high);
  EXPECT_EQ(meaning_text(entry.scaling, entry.low, entry.high), "raw * -0.1 + 5, in bar, 3 to 6");
}

TEST(Scaling, NothingThatIsNotFiniteIsALimitOrWithinOne) {
  od::VariableDescription variable;
  variable.type = DataType::real64;
  variable.scaling.scale = 10;
  variable.high_limit = bytes_of(std::bit_cast<std::uint64_t>(1e308), 64);
  variable.low_limit = bytes_of(std::bit_cast<std::uint64_t>(-1.0), 64);
  Entry entry;
  entry.type = variable.type;
  entry.bit_length = 64;
  describe_value(variable, entry);
  EXPECT_EQ(entry.high, std::nullopt);
  EXPECT_EQ(entry.low, -10);
  EXPECT_EQ(fault(entry, std::numeric_limits<double>::quiet_NaN()), ScalingFault::below_low);
  entry.low.reset();
  entry.high = 5;
  EXPECT_EQ(fault(entry, std::numeric_limits<double>::quiet_NaN()), ScalingFault::above_high);
  EXPECT_EQ(fault(entry, std::numeric_limits<double>::infinity()), ScalingFault::above_high);
}

TEST(Scaling, ALimitIsWithinItself) {
  Entry entry = entry_of(DataType::real32, 32, 1);
  entry.high = 100.099998474121;  // REAL32 100.1
  EXPECT_EQ(check_limits(entry, 100.1), ScalingFault::none);
  EXPECT_EQ(check_limits(entry, 100.11), ScalingFault::above_high);
  entry.high = 1e-7;
  EXPECT_EQ(check_limits(entry, 1e-7), ScalingFault::none);
  EXPECT_EQ(check_limits(entry, 1.1e-7), ScalingFault::above_high);
  entry = entry_of(DataType::unsigned64, 64, 1);
  entry.high = 1.84467440737095e19;  // 2^64 - 1 in 15 digits
  EXPECT_EQ(check_limits(entry, 18446744073709549568.0), ScalingFault::none);
}

TEST(Scaling, ANumberInTheNameIsNoUnit) {
  Entry entry;
  for (const auto& [name, unit] : {std::pair("Speed [rpm]", "rpm"), std::pair("Output [3]", ""),
                                   std::pair("Limits [-5..5]", ""), std::pair("Load [%]", "%"),
                                   std::pair("Odd []", ""), std::pair("[3] Odd", "")}) {
    od::VariableDescription variable;
    variable.name = name;
    describe_value(variable, entry);
    EXPECT_EQ(entry.scaling.unit, unit) << name;
  }
}

TEST(Scaling, TextsOfNumbers) {
  EXPECT_EQ(number_text(-0.25), "-0.25");
  EXPECT_EQ(number_text(1e300), "1e+300");
  EXPECT_EQ(number_text(-std::numeric_limits<double>::infinity()), "-inf");
  EXPECT_EQ(parse_number("+1.5"), 1.5);
  EXPECT_EQ(parse_number("0x1F"), 31);
  for (const char* text : {"", "0x", "1.5bar", " 1", "1,5", "--1"}) {
    EXPECT_EQ(parse_number(text), std::nullopt) << text;
  }
  EXPECT_EQ(meaning_text({}, {}, {}), "");
  EXPECT_EQ(meaning_text({.unit = "rpm"}, 1, {}), "in rpm, at least 1");
}

// A value that is written scaled and read scaled is the same value.
TEST(Scaling, ComesBackAsItWent) {
  const auto seed = std::random_device{}();
  SCOPED_TRACE("seed " + std::to_string(seed));
  std::mt19937_64 random(seed);
  constexpr std::array kTypes{DataType::integer8,   DataType::unsigned8,  DataType::integer16,
                              DataType::unsigned16, DataType::integer24,  DataType::unsigned32,
                              DataType::integer32,  DataType::unsigned40, DataType::integer40};
  for (int i = 0; i < 20'000; ++i) {
    const DataType type = kTypes[random() % kTypes.size()];
    const auto bits = static_cast<std::uint16_t>(1 + random() % od::bit_size(type));
    const double scale = std::pow(10, static_cast<int>(random() % 7) - 3) *
                         static_cast<double>(1 + random() % 999) * (random() % 2 == 0 ? 1 : -1);
    const double offset = static_cast<double>(static_cast<int>(random() % 2001) - 1000) / 4;
    const Entry entry = entry_of(type, bits, scale, offset);
    const std::uint64_t raw = load_le(std::span<const std::byte>(bytes_of(random(), bits)));
    ASSERT_EQ(written(entry, shown(entry, raw)), raw)
        << od::name(type) << ' ' << bits << " bits, scale " << scale << ", offset " << offset;
  }
}

}  // namespace
}  // namespace linegate::image
