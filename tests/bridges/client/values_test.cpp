// SPDX-License-Identifier: Apache-2.0
#include "bridges/client/values.h"

#include <cmath>
#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace linegate::client {
namespace {

using od::DataType;
using Bytes = std::vector<std::byte>;

Bytes bytes(std::initializer_list<int> values) {
  Bytes out;
  for (const int value : values)
    out.push_back(static_cast<std::byte>(value));
  return out;
}

struct Row {
  DataType type;
  std::uint16_t bits;
  Bytes raw;
  Data data;
};

std::vector<Row> table() {
  using I = std::int64_t;
  using U = std::uint64_t;
  using enum DataType;
  return {
      {boolean, 1, bytes({1}), true},
      {boolean, 8, bytes({0}), false},
      {integer8, 8, bytes({0x80}), I{-128}},
      {integer16, 16, bytes({0xFE, 0xFF}), I{-2}},
      {integer24, 24, bytes({0, 0, 0x80}), I{-8'388'608}},
      {integer32, 32, bytes({1, 0, 0, 0x80}), I{-2'147'483'647}},
      {integer40, 40, bytes({0xFF, 0xFF, 0xFF, 0xFF, 0x7F}), I{549'755'813'887}},
      {integer48, 48, bytes({0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF}), I{-1}},
      {integer56, 56, bytes({2, 0, 0, 0, 0, 0, 0}), I{2}},
      {integer64, 64, bytes({0, 0, 0, 0, 0, 0, 0, 0x80}), I{INT64_MIN}},
      {unsigned8, 8, bytes({0xFF}), U{255}},
      {unsigned16, 16, bytes({0x34, 0x12}), U{0x1234}},
      {unsigned24, 24, bytes({3, 2, 1}), U{0x010203}},
      {unsigned32, 32, bytes({0xFF, 0xFF, 0xFF, 0xFF}), U{0xFFFF'FFFF}},
      {unsigned40, 40, bytes({5, 4, 3, 2, 1}), U{0x01'0203'0405}},
      {unsigned48, 48, bytes({6, 5, 4, 3, 2, 1}), U{0x0102'0304'0506}},
      {unsigned56, 56, bytes({7, 6, 5, 4, 3, 2, 1}), U{0x01'0203'0405'0607}},
      {unsigned64, 64, bytes({255, 255, 255, 255, 255, 255, 255, 255}), U{UINT64_MAX}},
      {real32, 32, bytes({0, 0, 0xC0, 0xBF}), -1.5},
      {real64, 64, bytes({0, 0, 0, 0, 0, 0, 0xF8, 0x3F}), 1.5},
      {visible_string, 32, bytes({'a', 'b', 0, 0}), std::string("ab")},
      {visible_string, 32, bytes({0xFC, 0x80, 'z', 0xFF}),
       std::string("\xC3\xBC\xC2\x80z\xC3\xBF")},
      {visible_string, 16, bytes({0, 0}), std::string()},
      {visible_string, 12, bytes({'a', 2}), bytes({'a', 2})},  // no whole characters
      {unicode_string, 64, bytes({0xE9, 0, 0x3D, 0xD8, 0, 0xDE, 0, 0}),
       std::string("\xC3\xA9\xF0\x9F\x98\x80")},
      {unicode_string, 24, bytes({'a', 0, 'b'}), bytes({'a', 0, 'b'})},
      {octet_string, 24, bytes({1, 2, 0xFF}), bytes({1, 2, 0xFF})},
      {domain, 8, bytes({9}), bytes({9})},
      // 1 ms and 1 day after 1984-01-01.
      {time_of_day, 48, bytes({1, 0, 0, 0, 1, 0}), I{441'849'600'001'000'000}},
      {time_difference, 48, bytes({2, 0, 0, 0, 1, 0}), I{86'400'002'000'000}},
  };
}

TEST(ClientValues, EachTypeIsDecodedAndEncodedAsCiaDefinesIt) {
  for (const Row& row : table()) {
    SCOPED_TRACE(od::name(row.type));
    EXPECT_EQ(decode(row.type, row.bits, row.raw), row.data);
    Bytes raw;
    EXPECT_EQ(encode(row.data, row.type, row.bits, raw), Error::none);
    EXPECT_EQ(raw, row.raw);
  }
}

TEST(ClientValues, UnicodeIsUtf8AndHalfAPairIsReplaced) {
  EXPECT_EQ(decode(DataType::unicode_string, 64, bytes({0xE9, 0, 0x3D, 0xD8, 0, 0xDE, 0x3D, 0xD8})),
            Data(std::string("\xC3\xA9\xF0\x9F\x98\x80\xEF\xBF\xBD")));
}

TEST(ClientValues, ANumberOfAnUnexpectedSizeIsBytes) {
  EXPECT_EQ(decode(DataType::real32, 16, bytes({1, 2})), Data(bytes({1, 2})));
  EXPECT_EQ(decode(DataType::none, 8, bytes({7})), Data(bytes({7})));
  EXPECT_EQ(decode(DataType::unsigned32, 32, bytes({1, 2})), Data());
  EXPECT_EQ(decode(DataType::integer8, 0, {}), Data());
}

TEST(ClientValues, BitsBeyondTheAreaAreNone) {
  EXPECT_EQ(bits_of(bytes({0b1011'0000}), 4, 3), bytes({0b011}));
  EXPECT_EQ(bits_of(bytes({1, 2, 3}), 8, 16), bytes({2, 3}));
  EXPECT_TRUE(bits_of(bytes({1}), 4, 8).empty());
  EXPECT_TRUE(bits_of({}, 0xFFFF'FFFF, 0xFFFF).empty());
}

TEST(ClientValues, WhatDoesNotFitIsRefused) {
  Bytes out;
  EXPECT_EQ(encode(std::int64_t{-1}, DataType::unsigned8, 8, out), Error::out_of_range);
  EXPECT_EQ(encode(std::uint64_t{256}, DataType::unsigned8, 8, out), Error::out_of_range);
  EXPECT_EQ(encode(std::int64_t{-129}, DataType::integer8, 8, out), Error::out_of_range);
  EXPECT_EQ(encode(std::int64_t{2}, DataType::boolean, 1, out), Error::out_of_range);
  EXPECT_EQ(encode(1.5, DataType::integer16, 16, out), Error::out_of_range);
  EXPECT_EQ(encode(std::nan(""), DataType::integer16, 16, out), Error::out_of_range);
  EXPECT_EQ(encode(1e300, DataType::real32, 32, out), Error::out_of_range);
  EXPECT_EQ(encode(std::string("1"), DataType::unsigned8, 8, out), Error::wrong_type);
  EXPECT_EQ(encode(Data(), DataType::real64, 64, out), Error::wrong_type);
  EXPECT_EQ(encode(std::string("abc"), DataType::visible_string, 16, out), Error::out_of_range);
  EXPECT_EQ(encode(std::int64_t{-1}, DataType::time_difference, 48, out), Error::out_of_range);
  for (const char* const text : {"abcde", "\xE2\x82\xAC", "\xFC", "\xC3"})
    EXPECT_EQ(encode(std::string(text), DataType::visible_string, 32, out), Error::out_of_range);
  for (const char* const text : {"abc", "a\xF0\x9F\x98\x80", "\xED\xA0\x80"})
    EXPECT_EQ(encode(std::string(text), DataType::unicode_string, 32, out), Error::out_of_range);
  EXPECT_EQ(encode(std::string("a\0b", 3), DataType::visible_string, 32, out), Error::out_of_range);
  EXPECT_EQ(encode(std::string("a"), DataType::unicode_string, 24, out), Error::wrong_type);
  EXPECT_EQ(encode(bytes({1, 0x10}), DataType::octet_string, 12, out), Error::out_of_range);
  EXPECT_EQ(encode(bytes({1, 0x0F}), DataType::octet_string, 12, out), Error::none);
  EXPECT_EQ(encode(7.0, DataType::unsigned8, 8, out), Error::none);
  EXPECT_EQ(out, bytes({7}));
}

TEST(ClientValues, ANanIsTheSameAsItself) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_TRUE(is_same(nan, nan));
  EXPECT_FALSE(is_same(nan, 0.0));
  EXPECT_FALSE(is_same(nan, {}));
  EXPECT_FALSE(is_same(std::int64_t{1}, std::uint64_t{1}));
  EXPECT_TRUE(is_same(std::string("a"), std::string("a")));
}

TEST(ClientValues, AScaledValueIsADoubleInItsUnit) {
  image::Entry entry;
  entry.type = DataType::unsigned16;
  entry.bit_length = 16;
  entry.scaling = {.unit = "bar", .scale = 0.1, .offset = -40};
  entry.low = 0;
  EXPECT_EQ(scaled(entry, std::uint64_t{523}, bytes({0x0B, 2})), Data(12.3));
  Bytes out;
  EXPECT_EQ(encode_scaled(12.3, entry, out), Error::none);
  EXPECT_EQ(out, bytes({0x0B, 2}));
  EXPECT_EQ(encode_scaled(std::int64_t{12}, entry, out), Error::none);
  EXPECT_EQ(out, bytes({0x08, 2}));
  EXPECT_EQ(encode_scaled(-0.1, entry, out), Error::out_of_range) << "below its low limit";
  EXPECT_EQ(encode_scaled(6514.0, entry, out), Error::out_of_range);
  EXPECT_EQ(encode_scaled(std::numeric_limits<double>::quiet_NaN(), entry, out),
            Error::out_of_range);
  EXPECT_EQ(encode_scaled(std::string("12"), entry, out), Error::wrong_type);
  EXPECT_EQ(encode_scaled(bytes({1, 2}), entry, out), Error::wrong_type);
  EXPECT_EQ(out, bytes({0x08, 2}));
}

TEST(ClientValues, ANumberHasTheDigitsThatItNeeds) {
  EXPECT_EQ(text_of(123456789012.5), "123456789012.5");
  EXPECT_EQ(text_of(100'000.0), "100000");
  EXPECT_EQ(text_of(0.0), "0");
  EXPECT_EQ(text_of(0.0001), "0.0001");
  EXPECT_EQ(text_of(0.00001), "1e-05");
  EXPECT_EQ(text_of(1e16), "1e+16");
  EXPECT_EQ(text_of(-std::numeric_limits<double>::infinity()), "-inf");
}

TEST(ClientValues, LimitsHoldWithoutScaling) {
  image::Entry entry;
  entry.type = DataType::integer8;
  entry.bit_length = 8;
  entry.high = 10;
  Bytes out;
  EXPECT_EQ(scaled(entry, std::int64_t{-1}, bytes({255})), Data(std::int64_t{-1}));
  EXPECT_EQ(encode_scaled(std::int64_t{10}, entry, out), Error::none);
  EXPECT_EQ(encode_scaled(std::int64_t{11}, entry, out), Error::out_of_range);
  EXPECT_EQ(encode_scaled(bytes({11}), entry, out), Error::wrong_type);
}

}  // namespace
}  // namespace linegate::client
