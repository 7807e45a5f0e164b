// SPDX-License-Identifier: Apache-2.0
#include "bridges/console/value_text.h"

#include <bit>
#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include "stack/base/byte_order.h"

namespace linegate::console {
namespace {

using od::DataType;

std::vector<std::byte> bytes(std::initializer_list<int> values) {
  std::vector<std::byte> out;
  for (const int v : values) {
    out.push_back(static_cast<std::byte>(v));
  }
  return out;
}

TEST(ValueText, ByType) {
  EXPECT_EQ(to_text(DataType::unsigned16, bytes({0x34, 0x12})), "4660");
  EXPECT_EQ(to_text(DataType::integer16, bytes({0xFD, 0xFF})), "-3");
  EXPECT_EQ(to_text(DataType::integer24, bytes({0xFE, 0xFF, 0xFF})), "-2");
  EXPECT_EQ(to_text(DataType::unsigned64, bytes({255, 255, 255, 255, 255, 255, 255, 255})),
            "18446744073709551615");
  EXPECT_EQ(to_text(DataType::boolean, bytes({1})), "true");
  EXPECT_EQ(to_text(DataType::real32, bytes({0, 0, 0xC0, 0x3F})), "1.5");
  EXPECT_EQ(to_text(DataType::visible_string, bytes({'a', '"', 7})), "\"a\\\".\"");
  EXPECT_EQ(to_text(DataType::octet_string, bytes({1, 0xAB})), "01 AB");
  EXPECT_EQ(to_text(DataType::unsigned16, bytes({1, 2, 3})), "01 02 03") << "length does not fit";
}

template <class Bits>
std::vector<std::byte> bits_of(Bits bits) {
  std::vector<std::byte> out(sizeof(bits));
  store_le(std::span(out), bits);
  return out;
}

std::string text_of(double value) {
  return to_text(DataType::real64, bits_of(std::bit_cast<std::uint64_t>(value)));
}

std::string text_of(float value) {
  return to_text(DataType::real32, bits_of(std::bit_cast<std::uint32_t>(value)));
}

TEST(ValueText, RealsHaveTheDigitsOfTheirType) {
  EXPECT_EQ(text_of(123456789012.5), "123456789012.5");
  EXPECT_EQ(text_of(0.1), "0.1");
  EXPECT_EQ(text_of(0.1F), "0.1");
  EXPECT_EQ(text_of(static_cast<double>(0.1F)), "0.10000000149011612");
  EXPECT_EQ(text_of(100'000.0), "100000");
  EXPECT_EQ(text_of(-0.0), "-0");
  EXPECT_EQ(text_of(0.0001), "0.0001");
  EXPECT_EQ(text_of(0.00001), "1e-05");
  EXPECT_EQ(text_of(9'007'199'254'740'992.0), "9007199254740992");
  EXPECT_EQ(text_of(1e16), "1e+16");
  EXPECT_EQ(text_of(16'777'216.0F), "16777216");
  EXPECT_EQ(text_of(1e9F), "1e+09");
  EXPECT_EQ(text_of(std::numeric_limits<double>::infinity()), "inf");
  EXPECT_EQ(text_of(std::numeric_limits<float>::quiet_NaN()), "nan");
  const image::Entry energy{.bit_length = 64, .type = DataType::real64, .name = "meter.Energy"};
  EXPECT_EQ(to_text(energy, bits_of(std::bit_cast<std::uint64_t>(123456789012.5))),
            "123456789012.5");
}

TEST(ValueText, RealsThereAndBack) {
  for (std::uint64_t i = 0; i < 20'000; ++i) {
    const std::uint64_t any = i * 0x9E37'79B9'7F4A'7C15U;  // spread over all bits
    const auto wide = bits_of(any);
    if (std::isfinite(std::bit_cast<double>(any))) {
      ASSERT_EQ(from_text(DataType::real64, to_text(DataType::real64, wide)), wide) << any;
    }
    const auto half = static_cast<std::uint32_t>(any >> 32U);
    const auto narrow = bits_of(half);
    if (std::isfinite(std::bit_cast<float>(half))) {
      ASSERT_EQ(from_text(DataType::real32, to_text(DataType::real32, narrow)), narrow) << half;
    }
  }
  EXPECT_EQ(from_text(DataType::real32, "1e-60"), bytes({0, 0, 0, 0}));
}

TEST(ValueText, ATypedValueIsInTheUnitOfTheEntry) {
  const image::Entry entry{.bit_length = 16,
                           .type = DataType::unsigned16,
                           .name = "ram.Pressure",
                           .scaling = {.unit = "bar", .scale = 0.1, .offset = -40},
                           .low = 0,
                           .high = 250};
  const auto error = [&entry](std::string_view text, bool raw = false) {
    const TypedValue typed = typed_value(entry, text, raw);
    EXPECT_TRUE(typed.data.empty());
    return typed.error;
  };
  EXPECT_EQ(typed_value(entry, "12.3", false).data, bytes({0x0B, 0x02}));
  EXPECT_EQ(to_text(entry, bytes({0x0B, 0x02})), "12.3");
  EXPECT_EQ(to_number(entry, bytes({0x0B, 0x02})), 12.3);
  EXPECT_EQ(error("-1"), "'-1' is below the low limit 0 bar");
  EXPECT_EQ(error("251"), "'251' is above the high limit 250 bar");
  EXPECT_EQ(error("a bar"), "'a bar' is no number");
  EXPECT_EQ(error("12.3", true), "'12.3' is not a value of UNSIGNED16");
  EXPECT_EQ(typed_value(entry, "3", true).data, bytes({3, 0})) << "-39.7 bar";
  image::Entry open = entry;
  open.low.reset();
  open.high.reset();
  EXPECT_EQ(typed_value(open, "6514", false).error, "'6514' does not fit the type UNSIGNED16");
  EXPECT_EQ(typed_value(open, "nan", false).error, "'nan' does not fit the type UNSIGNED16");
}

TEST(ValueText, LimitsHoldForAValueWithoutScaling) {
  const image::Entry entry{
      .bit_length = 8, .type = DataType::integer8, .name = "ram.Mode", .high = 10};
  EXPECT_EQ(typed_value(entry, "10", false).data, bytes({10}));
  EXPECT_EQ(typed_value(entry, "11", false).error, "'11' is above the high limit 10");
  EXPECT_EQ(typed_value(entry, "11", true).data, bytes({11}));
}

TEST(ValueText, FromTextIsTheInverse) {
  EXPECT_EQ(from_text(DataType::unsigned16, "0x1234"), bytes({0x34, 0x12}));
  EXPECT_EQ(from_text(DataType::integer8, "-128"), bytes({0x80}));
  EXPECT_EQ(from_text(DataType::integer64, "-1"), bytes({255, 255, 255, 255, 255, 255, 255, 255}));
  EXPECT_EQ(from_text(DataType::unsigned64, "18446744073709551615"),
            bytes({255, 255, 255, 255, 255, 255, 255, 255}));
  EXPECT_EQ(from_text(DataType::boolean, "true"), bytes({1}));
  EXPECT_EQ(from_text(DataType::real32, "1.5"), bytes({0, 0, 0xC0, 0x3F}));
  EXPECT_EQ(from_text(DataType::octet_string, "01 ab"), bytes({1, 0xAB}));
  EXPECT_EQ(from_text(DataType::visible_string, "ab"), bytes({'a', 'b'}));
}

TEST(ValueText, IntegersOfEveryWidthThereAndBack) {
  using enum DataType;
  for (const DataType type :
       {integer8, integer16, integer24, integer32, integer40, integer48, integer56, integer64}) {
    const auto low = from_text(type, "-3");
    ASSERT_TRUE(low) << od::name(type);
    EXPECT_EQ(low->size(), od::byte_size(type));
    EXPECT_EQ(to_text(type, *low), "-3");
    std::vector<std::byte> lowest(od::byte_size(type));
    lowest.back() = std::byte{0x80};
    EXPECT_EQ(from_text(type, to_text(type, lowest)), lowest) << od::name(type);
  }
  for (const DataType type : {unsigned8, unsigned16, unsigned24, unsigned32, unsigned40, unsigned48,
                              unsigned56, unsigned64}) {
    const std::vector<std::byte> largest(od::byte_size(type), std::byte{0xFF});
    EXPECT_EQ(from_text(type, to_text(type, largest)), largest) << od::name(type);
  }
}

TEST(ValueText, TimesAreTheirBytes) {
  const auto value = bytes({1, 2, 3, 4, 5, 6});
  EXPECT_EQ(to_text(DataType::time_of_day, value), "01 02 03 04 05 06");
  EXPECT_EQ(from_text(DataType::time_difference, "01 02 03 04 05 06"), value);
  EXPECT_EQ(from_text(DataType::time_of_day, "01 02 03 04 05"), std::nullopt);
}

TEST(ValueText, WhatDoesNotFitIsRefused) {
  EXPECT_EQ(from_text(DataType::unsigned8, "256"), std::nullopt);
  EXPECT_EQ(from_text(DataType::unsigned8, "-1"), std::nullopt);
  EXPECT_EQ(from_text(DataType::integer8, "128"), std::nullopt);
  EXPECT_EQ(from_text(DataType::integer8, "-129"), std::nullopt);
  EXPECT_EQ(from_text(DataType::boolean, "2"), std::nullopt);
  EXPECT_EQ(from_text(DataType::unsigned32, ""), std::nullopt);
  EXPECT_EQ(from_text(DataType::unsigned32, "12x"), std::nullopt);
  EXPECT_EQ(from_text(DataType::real64, "x"), std::nullopt);
  EXPECT_EQ(from_text(DataType::real32, "1e39"), std::nullopt);
  const auto largest = bits_of(std::bit_cast<std::uint32_t>(std::numeric_limits<float>::max()));
  EXPECT_EQ(from_text(DataType::real32, to_text(DataType::real32, largest)), largest);
  EXPECT_EQ(from_text(DataType::octet_string, "123"), std::nullopt);
}

TEST(ValueText, TypesByTheirShortAndLongNames) {
  EXPECT_EQ(type_from_name("u16"), DataType::unsigned16);
  EXPECT_EQ(type_from_name("UNSIGNED16"), DataType::unsigned16);
  EXPECT_EQ(type_from_name("i48"), DataType::integer48);
  EXPECT_EQ(type_from_name("vs"), DataType::visible_string);
  EXPECT_EQ(type_from_name("td"), DataType::time_difference);
  EXPECT_EQ(type_from_name("Unicode_String"), DataType::unicode_string);
  EXPECT_EQ(type_from_name("int"), std::nullopt);
}

}  // namespace
}  // namespace linegate::console
