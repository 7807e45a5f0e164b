// SPDX-License-Identifier: Apache-2.0
#include "stack/storage/image.h"

#include <string_view>

#include <gtest/gtest.h>

#include "stack/base/byte_order.h"

namespace linegate::storage {
namespace {

constexpr Owner kOwner{5, {0x11, 0x22, 0x33}};

std::vector<std::byte> bytes(std::initializer_list<int> values) {
  std::vector<std::byte> out;
  for (const int value : values) {
    out.push_back(static_cast<std::byte>(value));
  }
  return out;
}

std::vector<StoredValue> two_values() {
  return {{{0x1017, 0}, bytes({0xE8, 0x03})}, {{0x1400, 1}, bytes({0x01, 0x02, 0x00, 0x80})}};
}

// Replaces the last four bytes with the CRC of the bytes before.
void seal(std::vector<std::byte>& image) {
  const std::size_t size = image.size() - 4;
  store_le(image.data() + size, crc32(std::span(image).first(size)));
}

TEST(StorageImage, Crc32IsThatOfEthernet) {
  constexpr std::string_view kCheck = "123456789";
  EXPECT_EQ(crc32(std::as_bytes(std::span(kCheck))), 0xCBF4'3926U);
}

// The values are the example of a concise DCF in CiA 302-3.
TEST(StorageImage, BytesAreAsDocumented) {
  std::vector<std::byte> expected =
      bytes({'L',  'G',  'S',  'P', 1, 0, 5, 0, 0x11, 0,    0,    0,    0x22, 0, 0, 0, 0x33, 0,
             0,    0,    24,   0,   0, 0, 2, 0, 0,    0,    0x17, 0x10, 0,    2, 0, 0, 0,    0xE8,
             0x03, 0x00, 0x14, 1,   4, 0, 0, 0, 0x01, 0x02, 0x00, 0x80, 0,    0, 0, 0});
  store_le(expected.data() + 20, std::uint32_t{24});
  seal(expected);
  EXPECT_EQ(encode(kOwner, two_values()), expected);
}

TEST(StorageImage, WhatWasStoredComesBack) {
  std::vector<StoredValue> values;
  EXPECT_EQ(decode(encode(kOwner, two_values()), kOwner, values), Damage::none);
  EXPECT_EQ(values, two_values());
  EXPECT_EQ(decode(encode(kOwner, {}), kOwner, values), Damage::none);
  EXPECT_TRUE(values.empty());
}

TEST(StorageImage, NothingKeptIsNoDamage) {
  std::vector<StoredValue> values = two_values();
  EXPECT_EQ(decode({}, kOwner, values), Damage::none);
  EXPECT_TRUE(values.empty());
}

TEST(StorageImage, EveryBitThatFellOverIsFound) {
  const std::vector<std::byte> good = encode(kOwner, two_values());
  std::vector<StoredValue> values;
  for (std::size_t bit = 0; bit < 8 * good.size(); ++bit) {
    std::vector<std::byte> image = good;
    image[bit / 8] ^= static_cast<std::byte>(1U << bit % 8);
    EXPECT_NE(decode(image, kOwner, values), Damage::none) << "bit " << bit;
    EXPECT_TRUE(values.empty());
  }
}

TEST(StorageImage, AnImageThatWasCutOrHasMoreIsDamaged) {
  std::vector<std::byte> image = encode(kOwner, two_values());
  std::vector<StoredValue> values;
  for (std::size_t size = 1; size < image.size(); ++size) {
    EXPECT_EQ(decode(std::span(image).first(size), kOwner, values), Damage::damaged) << size;
  }
  image.push_back(std::byte{0});
  EXPECT_EQ(decode(image, kOwner, values), Damage::damaged);
}

TEST(StorageImage, AnotherVersionIsToldFromDamage) {
  std::vector<std::byte> image = encode(kOwner, two_values());
  image[4] = std::byte{2};
  seal(image);
  std::vector<StoredValue> values;
  EXPECT_EQ(decode(image, kOwner, values), Damage::version);
}

TEST(StorageImage, AnImageOfAnotherDeviceIsRefused) {
  const std::vector<std::byte> image = encode(kOwner, two_values());
  std::vector<StoredValue> values;
  for (const Owner& other : {Owner{6, kOwner.identity}, Owner{5, {0x12, 0x22, 0x33}},
                             Owner{5, {0x11, 0x23, 0x33}}, Owner{5, {0x11, 0x22, 0x34}}}) {
    EXPECT_EQ(decode(image, other, values), Damage::owner);
  }
}

// The image has a valid CRC, as if made on purpose.
TEST(StorageImage, ValuesThatContradictTheirLengthAreDamage) {
  struct Case {
    const char* what;
    std::size_t position;
    int value;
  };
  constexpr Case kCases[] = {{"count too high", 24, 3},  {"count too low", 24, 1},
                             {"count absurd", 27, 0xFF}, {"size too high", 31, 3},
                             {"size absurd", 34, 0xFF},  {"last size too high", 40, 5}};
  for (const Case& wrong : kCases) {
    std::vector<std::byte> image = encode(kOwner, two_values());
    image[wrong.position] = static_cast<std::byte>(wrong.value);
    seal(image);
    std::vector<StoredValue> values;
    EXPECT_EQ(decode(image, kOwner, values), Damage::damaged) << wrong.what;
    EXPECT_TRUE(values.empty()) << wrong.what;
  }
}

}  // namespace
}  // namespace linegate::storage
