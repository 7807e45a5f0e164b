// SPDX-License-Identifier: Apache-2.0
#include <bit>
#include <limits>

#include <gtest/gtest.h>

#include "tests/stack/od/objects.h"

namespace linegate::od {
namespace {

using test::bytes;
using test::copy;
using test::text;
using test::var;

Dictionary limited(DataType type, std::vector<std::byte> low, std::vector<std::byte> high) {
  ObjectDescription description = var(0x2000, type);
  description.variables[0].low_limit = std::move(low);
  description.variables[0].high_limit = std::move(high);
  Dictionary dictionary;
  EXPECT_TRUE(dictionary.add(description));
  return dictionary;
}

template <class Real, class Raw>
std::vector<std::byte> real(Real value) {
  std::vector<std::byte> out(sizeof(Real));
  store_le(std::span<std::byte>(out), std::bit_cast<Raw>(value));
  return out;
}

TEST(Write, NeedsTheRight) {
  const std::pair<Access, AbortCode> table[] = {
      {Access::ro, AbortCode::read_only}, {Access::wo, AbortCode::none},
      {Access::rw, AbortCode::none},      {Access::rwr, AbortCode::none},
      {Access::rww, AbortCode::none},     {Access::constant, AbortCode::read_only}};
  for (const auto& [access, expected] : table) {
    Dictionary dictionary;
    ASSERT_TRUE(dictionary.add(var(0x2000, DataType::unsigned8, bytes({1}), access)));
    EXPECT_EQ(dictionary.check({0x2000, 0}, bytes({2})), expected);
    EXPECT_EQ(dictionary.number({0x2000, 0}), 1U);
    EXPECT_EQ(dictionary.write({0x2000, 0}, bytes({2})), expected);
    EXPECT_EQ(dictionary.number({0x2000, 0}), expected == AbortCode::none ? 2U : 1U);
  }
}

TEST(Write, TellsWhatDoesNotExist) {
  Dictionary dictionary;
  ASSERT_TRUE(dictionary.add(var(0x2000, DataType::unsigned8)));
  EXPECT_EQ(dictionary.write({0x2001, 0}, bytes({1})), AbortCode::no_object);
  EXPECT_EQ(dictionary.write({0x2000, 1}, bytes({1})), AbortCode::no_sub_index);
  EXPECT_EQ(dictionary.write({0x2001, 255}, bytes({1})), AbortCode::no_object);
}

TEST(Write, SubIndexFFhIsConst) {
  Dictionary dictionary;
  ASSERT_TRUE(dictionary.add(var(0x2000, DataType::unsigned8)));
  EXPECT_EQ(dictionary.write({0x2000, 255}, bytes({7, 5, 0, 0})), AbortCode::read_only);
  EXPECT_EQ(dictionary.check({0x2000, 255}, bytes({7, 5, 0, 0})), AbortCode::read_only);
  EXPECT_EQ(dictionary.highest_sub(0x2000), 0);
}

TEST(Write, FixedTypesTakeTheirLengthOnly) {
  Dictionary dictionary;
  ASSERT_TRUE(dictionary.add(var(0x2000, DataType::unsigned24)));
  EXPECT_EQ(dictionary.write({0x2000, 0}, bytes({1, 2})), AbortCode::length_too_low);
  EXPECT_EQ(dictionary.write({0x2000, 0}, {}), AbortCode::length_too_low);
  EXPECT_EQ(dictionary.write({0x2000, 0}, bytes({1, 2, 3, 4})), AbortCode::length_too_high);
  EXPECT_EQ(dictionary.number({0x2000, 0}), 0U);
  EXPECT_EQ(dictionary.write({0x2000, 0}, bytes({1, 2, 3})), AbortCode::none);
  EXPECT_EQ(dictionary.number({0x2000, 0}), 0x030201U);
}

TEST(Write, TheRightIsCheckedBeforeTheLengthAndTheLengthBeforeTheLimits) {
  ObjectDescription description = var(0x2000, DataType::unsigned16, bytes({5}), Access::ro);
  description.variables[0].high_limit = bytes({9, 0});
  Dictionary dictionary;
  ASSERT_TRUE(dictionary.add(description));
  EXPECT_EQ(dictionary.write({0x2000, 0}, bytes({99})), AbortCode::read_only);
  Dictionary writable = limited(DataType::unsigned16, {}, bytes({9, 0}));
  EXPECT_EQ(writable.write({0x2000, 0}, bytes({99})), AbortCode::length_too_low);
}

TEST(Write, StringsTakeUpTo64BytesOrTheDescribedLength) {
  Dictionary dictionary;
  ASSERT_TRUE(dictionary.add(var(0x2000, DataType::visible_string, text("short"))));
  ASSERT_TRUE(dictionary.add(var(0x2001, DataType::octet_string, text(std::string(70, 'x')))));
  EXPECT_EQ(dictionary.write({0x2000, 0}, text(std::string(64, 'a'))), AbortCode::none);
  EXPECT_EQ(dictionary.read({0x2000, 0}).value().size(), 64U);
  EXPECT_EQ(dictionary.write({0x2000, 0}, text(std::string(65, 'a'))), AbortCode::length_too_high);
  EXPECT_EQ(dictionary.write({0x2000, 0}, {}), AbortCode::none);
  EXPECT_EQ(dictionary.read({0x2000, 0}).value().size(), 0U);
  EXPECT_EQ(dictionary.write({0x2001, 0}, text(std::string(70, 'a'))), AbortCode::none);
  EXPECT_EQ(dictionary.write({0x2001, 0}, text(std::string(71, 'a'))), AbortCode::length_too_high);
}

TEST(Write, UnicodeStringsTakeWholeCharacters) {
  Dictionary dictionary;
  ASSERT_TRUE(dictionary.add(var(0x2000, DataType::unicode_string)));
  EXPECT_EQ(dictionary.write({0x2000, 0}, bytes({0x41, 0, 0x42})), AbortCode::length_mismatch);
  EXPECT_EQ(dictionary.write({0x2000, 0}, bytes({0x41, 0})), AbortCode::none);
}

TEST(Write, DomainsGrowUpTo16MiB) {
  Dictionary dictionary;
  ASSERT_TRUE(dictionary.add(var(0x1F50, DataType::domain)));
  EXPECT_EQ(dictionary.read({0x1F50, 0}).value().size(), 0U);
  EXPECT_EQ(dictionary.find({0x1F50, 0})->capacity, 0x100'0000U);
  const std::vector<std::byte> longest(0x100'0000, std::byte{0x5A});
  EXPECT_EQ(dictionary.write({0x1F50, 0}, longest), AbortCode::none);
  EXPECT_EQ(copy(*dictionary.read({0x1F50, 0})), longest);
  EXPECT_EQ(dictionary.write({0x1F50, 0}, std::vector<std::byte>(0x100'0001)),
            AbortCode::length_too_high);
  EXPECT_EQ(dictionary.write({0x1F50, 0}, bytes({1})), AbortCode::none);
  EXPECT_EQ(copy(*dictionary.read({0x1F50, 0})), bytes({1}));
}

TEST(Write, UnsignedLimits) {
  Dictionary dictionary = limited(DataType::unsigned16, bytes({0x02, 0x01}), bytes({0x00, 0x90}));
  EXPECT_EQ(dictionary.write({0x2000, 0}, bytes({0x01, 0x01})), AbortCode::value_too_low);
  EXPECT_EQ(dictionary.write({0x2000, 0}, bytes({0x02, 0x01})), AbortCode::none);
  EXPECT_EQ(dictionary.write({0x2000, 0}, bytes({0x00, 0x90})), AbortCode::none);
  EXPECT_EQ(dictionary.write({0x2000, 0}, bytes({0x01, 0x90})), AbortCode::value_too_high);
}

TEST(Write, SignedLimits) {
  // -2 .. 1
  Dictionary dictionary = limited(DataType::integer24, bytes({0xFE, 0xFF, 0xFF}), bytes({1, 0, 0}));
  EXPECT_EQ(dictionary.write({0x2000, 0}, bytes({0xFD, 0xFF, 0xFF})), AbortCode::value_too_low);
  EXPECT_EQ(dictionary.write({0x2000, 0}, bytes({0xFE, 0xFF, 0xFF})), AbortCode::none);
  EXPECT_EQ(dictionary.write({0x2000, 0}, bytes({0xFF, 0xFF, 0xFF})), AbortCode::none);
  EXPECT_EQ(dictionary.write({0x2000, 0}, bytes({1, 0, 0})), AbortCode::none);
  EXPECT_EQ(dictionary.write({0x2000, 0}, bytes({2, 0, 0})), AbortCode::value_too_high);
}

TEST(Write, SignedLimitsOf64Bits) {
  Dictionary dictionary = limited(DataType::integer64, {}, bytes({0, 0, 0, 0, 0, 0, 0, 0}));
  EXPECT_EQ(dictionary.write({0x2000, 0}, bytes({0, 0, 0, 0, 0, 0, 0, 0x80})), AbortCode::none);
  EXPECT_EQ(dictionary.write({0x2000, 0}, bytes({1, 0, 0, 0, 0, 0, 0, 0})),
            AbortCode::value_too_high);
}

TEST(Write, RealLimits) {
  const auto real32 = real<float, std::uint32_t>;
  Dictionary single = limited(DataType::real32, real32(-1.5F), real32(2.5F));
  EXPECT_EQ(single.write({0x2000, 0}, real32(-1.6F)), AbortCode::value_too_low);
  EXPECT_EQ(single.write({0x2000, 0}, real32(-1.5F)), AbortCode::none);
  EXPECT_EQ(single.write({0x2000, 0}, real32(2.6F)), AbortCode::value_too_high);
  EXPECT_EQ(single.write({0x2000, 0}, real32(std::numeric_limits<float>::quiet_NaN())),
            AbortCode::invalid_value);
  const auto real64 = real<double, std::uint64_t>;
  Dictionary twice = limited(DataType::real64, real64(0.1), {});
  EXPECT_EQ(twice.write({0x2000, 0}, real64(0.0999)), AbortCode::value_too_low);
  EXPECT_EQ(twice.write({0x2000, 0}, real64(1e300)), AbortCode::none);
}

TEST(Write, LimitsOfAWrongLengthAreNone) {
  Dictionary dictionary = limited(DataType::unsigned16, bytes({5}), {});
  EXPECT_EQ(dictionary.write({0x2000, 0}, bytes({1, 0})), AbortCode::none);
}

TEST(Set, IgnoresRightsAndLimitsButNotTheLength) {
  ObjectDescription description = var(0x2000, DataType::unsigned16, {}, Access::constant);
  description.variables[0].high_limit = bytes({9, 0});
  Dictionary dictionary;
  ASSERT_TRUE(dictionary.add(description));
  EXPECT_TRUE(dictionary.set({0x2000, 0}, bytes({99, 0})));
  EXPECT_EQ(dictionary.number({0x2000, 0}), 99U);
  EXPECT_FALSE(dictionary.set({0x2000, 0}, bytes({1})));
  EXPECT_FALSE(dictionary.set({0x2000, 1}, bytes({1, 0})));
}

TEST(Set, NumbersFitByTheirValue) {
  Dictionary dictionary;
  ASSERT_TRUE(dictionary.add(var(0x2000, DataType::unsigned8)));
  ASSERT_TRUE(dictionary.add(var(0x2001, DataType::integer32)));
  ASSERT_TRUE(dictionary.add(var(0x2002, DataType::unsigned64)));
  ASSERT_TRUE(dictionary.add(var(0x2003, DataType::visible_string)));
  EXPECT_TRUE(dictionary.set({0x2000, 0}, 255));
  EXPECT_FALSE(dictionary.set({0x2000, 0}, 256));
  EXPECT_FALSE(dictionary.set({0x2000, 0}, -129));
  EXPECT_EQ(dictionary.number({0x2000, 0}), 255U);
  EXPECT_TRUE(dictionary.set({0x2001, 0}, std::int8_t{-2}));
  EXPECT_EQ(dictionary.number({0x2001, 0}), 0xFFFF'FFFEU);
  EXPECT_TRUE(dictionary.set({0x2002, 0}, std::numeric_limits<std::uint64_t>::max()));
  EXPECT_TRUE(dictionary.set({0x2000, 0}, true));
  EXPECT_EQ(dictionary.number({0x2000, 0}), 1U);
  EXPECT_FALSE(dictionary.set({0x2003, 0}, 1));
  EXPECT_FALSE(dictionary.set({0x2004, 0}, 1));
}

}  // namespace
}  // namespace linegate::od
