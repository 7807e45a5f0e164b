// SPDX-License-Identifier: Apache-2.0
#include "stack/base/byte_order.h"

#include <array>

#include <gtest/gtest.h>

namespace linegate {
namespace {

std::array<std::byte, 8> bytes(std::initializer_list<int> values) {
  std::array<std::byte, 8> out{};
  std::size_t i = 0;
  for (int v : values) {
    out[i++] = static_cast<std::byte>(v);
  }
  return out;
}

TEST(ByteOrder, LeastSignificantByteComesFirst) {
  const auto raw = bytes({0x78, 0x56, 0x34, 0x12, 0xEF, 0xCD, 0xAB, 0x90});
  EXPECT_EQ(load_le<std::uint8_t>(raw.data()), 0x78U);
  EXPECT_EQ(load_le<std::uint16_t>(raw.data()), 0x5678U);
  EXPECT_EQ(load_le<std::uint32_t>(raw.data()), 0x12345678U);
  EXPECT_EQ(load_le<std::uint64_t>(raw.data()), 0x90ABCDEF12345678U);
}

TEST(ByteOrder, OddSizesAreZeroExtended) {
  const auto raw = bytes({0x01, 0x02, 0x83, 0, 0, 0, 0, 0});
  EXPECT_EQ(load_le(std::span(raw).first(3)), 0x830201U);
  EXPECT_EQ(load_le(std::span(raw).first(0)), 0U);
}

TEST(ByteOrder, StoreIsTheInverseOfLoad) {
  std::array<std::byte, 8> raw{};
  store_le(raw.data() + 1, std::uint32_t{0xA1B2C3D4});
  EXPECT_EQ(raw, bytes({0, 0xD4, 0xC3, 0xB2, 0xA1, 0, 0, 0}));
  store_le(std::span(raw).subspan(1, 3), 0x112233);
  EXPECT_EQ(raw, bytes({0, 0x33, 0x22, 0x11, 0xA1, 0, 0, 0}));
}

}  // namespace
}  // namespace linegate
