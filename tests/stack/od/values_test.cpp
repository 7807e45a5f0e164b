// SPDX-License-Identifier: Apache-2.0
// Every data type of CiA 301 as a value in the dictionary: its length, its byte order, its limits.
#include <bit>

#include <gtest/gtest.h>

#include "tests/stack/od/objects.h"

namespace linegate::od {
namespace {

using test::bytes;
using test::copy;
using test::object;
using test::var;
using test::variable;

constexpr Address kValueAt{0x2000, 0};

enum class Order { none, sign, magnitude, real };

struct TypeRow {
  DataType type;
  unsigned size;  // bytes, 0 = variable
  Order order;
};

constexpr TypeRow kTypes[] = {
    {DataType::boolean, 1, Order::magnitude},    {DataType::integer8, 1, Order::sign},
    {DataType::integer16, 2, Order::sign},       {DataType::integer24, 3, Order::sign},
    {DataType::integer32, 4, Order::sign},       {DataType::integer40, 5, Order::sign},
    {DataType::integer48, 6, Order::sign},       {DataType::integer56, 7, Order::sign},
    {DataType::integer64, 8, Order::sign},       {DataType::unsigned8, 1, Order::magnitude},
    {DataType::unsigned16, 2, Order::magnitude}, {DataType::unsigned24, 3, Order::magnitude},
    {DataType::unsigned32, 4, Order::magnitude}, {DataType::unsigned40, 5, Order::magnitude},
    {DataType::unsigned48, 6, Order::magnitude}, {DataType::unsigned56, 7, Order::magnitude},
    {DataType::unsigned64, 8, Order::magnitude}, {DataType::real32, 4, Order::real},
    {DataType::real64, 8, Order::real},          {DataType::time_of_day, 6, Order::none},
    {DataType::time_difference, 6, Order::none}, {DataType::visible_string, 0, Order::none},
    {DataType::octet_string, 0, Order::none},    {DataType::unicode_string, 0, Order::none},
    {DataType::domain, 0, Order::none},
};

// The number as a value of the row's type.
std::vector<std::byte> encoded(const TypeRow& row, int number) {
  std::vector<std::byte> out(row.size);
  std::uint64_t raw = static_cast<std::uint64_t>(std::int64_t{number});
  if (row.type == DataType::real32) {
    raw = std::bit_cast<std::uint32_t>(static_cast<float>(number));
  } else if (row.type == DataType::real64) {
    raw = std::bit_cast<std::uint64_t>(static_cast<double>(number));
  }
  store_le(std::span<std::byte>(out), raw);
  return out;
}

TEST(Strings, AreAsLongAsTheDeviceSetsThem) {
  Dictionary dictionary;
  ASSERT_TRUE(dictionary.add(var(0x2000, DataType::visible_string, test::text("abc"))).ok());
  const std::vector<std::byte> longer(1000, std::byte{'x'});
  EXPECT_EQ(dictionary.write(kValueAt, longer), AbortCode::length_too_high);
  EXPECT_TRUE(dictionary.set(kValueAt, longer));
  EXPECT_EQ(copy(*dictionary.read(kValueAt)), longer);
  EXPECT_TRUE(dictionary.set(kValueAt, test::text("short")));
  EXPECT_EQ(copy(*dictionary.read(kValueAt)), test::text("short"));
  dictionary.reset_values(0x2000, 0x2000);
  EXPECT_EQ(copy(*dictionary.read(kValueAt)), test::text("abc"));
  EXPECT_TRUE(dictionary.restore(kValueAt, std::vector<std::byte>(2000, std::byte{'y'})));
  EXPECT_EQ(dictionary.read(kValueAt)->size(), 2000U);
  EXPECT_FALSE(dictionary.set(kValueAt, std::vector<std::byte>(16 * 1024 * 1024 + 1)));
}

Dictionary limited(const TypeRow& row, int low, int high) {
  ObjectDescription description = var(kValueAt.index, row.type);
  description.variables[0].low_limit = encoded(row, low);
  description.variables[0].high_limit = encoded(row, high);
  Dictionary dictionary;
  EXPECT_TRUE(dictionary.add(description));
  return dictionary;
}

TEST(Values, OfEveryTypeTakeTheirLengthAndComeBack) {
  for (const TypeRow& row : kTypes) {
    SCOPED_TRACE(name(row.type));
    Dictionary dictionary;
    ASSERT_TRUE(dictionary.add(var(kValueAt.index, row.type)));
    EXPECT_EQ(dictionary.read(kValueAt).value().size(), row.size);
    std::vector<std::byte> value(row.size == 0 ? 6 : row.size, std::byte{0xC1});
    if (row.type == DataType::boolean) {
      value = bytes({1});
    }
    EXPECT_EQ(dictionary.write(kValueAt, value), AbortCode::none);
    EXPECT_EQ(copy(*dictionary.read(kValueAt)), value);
    if (row.size != 0) {
      value.push_back(std::byte{0});
      EXPECT_EQ(dictionary.write(kValueAt, value), AbortCode::length_too_high);
      value.resize(row.size - 1);
      EXPECT_EQ(dictionary.write(kValueAt, value), AbortCode::length_too_low);
    } else {
      EXPECT_EQ(dictionary.write(kValueAt, {}), AbortCode::none);
      EXPECT_EQ(dictionary.read(kValueAt).value().size(), 0U);
    }
  }
}

TEST(Values, OfTypesWithAnOrderHaveLimits) {
  for (const TypeRow& row : kTypes) {
    if (row.type == DataType::boolean) {
      continue;  // BOOLEAN is tested below
    }
    SCOPED_TRACE(name(row.type));
    const bool negative = row.order == Order::sign || row.order == Order::real;
    const int low = negative ? -3 : 2;
    Dictionary dictionary = limited(row, low, 5);
    const bool ordered = row.order != Order::none;
    EXPECT_EQ(dictionary.write(kValueAt, encoded(row, low - 1)),
              ordered ? AbortCode::value_too_low : AbortCode::none);
    EXPECT_EQ(dictionary.write(kValueAt, encoded(row, low)), AbortCode::none);
    EXPECT_EQ(dictionary.write(kValueAt, encoded(row, 5)), AbortCode::none);
    EXPECT_EQ(dictionary.write(kValueAt, encoded(row, 6)),
              ordered ? AbortCode::value_too_high : AbortCode::none);
  }
}

TEST(Values, NoneIsRightWhenTheHighLimitIsBelowTheLow) {
  for (const TypeRow& row : kTypes) {
    if (row.order != Order::none && row.type != DataType::boolean) {
      Dictionary dictionary = limited(row, 5, 3);
      EXPECT_EQ(dictionary.write(kValueAt, encoded(row, 4)), AbortCode::max_less_than_min)
          << name(row.type);
    }
  }
}

TEST(Values, BooleanIsTrueOrFalse) {
  Dictionary dictionary;
  ASSERT_TRUE(dictionary.add(var(kValueAt.index, DataType::boolean)));
  EXPECT_EQ(dictionary.write(kValueAt, bytes({1})), AbortCode::none);
  EXPECT_EQ(dictionary.write(kValueAt, bytes({2})), AbortCode::invalid_value);
  EXPECT_EQ(dictionary.number(kValueAt), 1U);
  EXPECT_EQ(dictionary.write(kValueAt, bytes({0})), AbortCode::none);
}

TEST(Values, OfTheDeviceItselfAreSignExtendedIntoEveryInteger) {
  for (const TypeRow& row : kTypes) {
    if (row.order != Order::sign) {
      continue;
    }
    SCOPED_TRACE(name(row.type));
    Dictionary dictionary;
    ASSERT_TRUE(dictionary.add(var(kValueAt.index, row.type)));
    ASSERT_TRUE(dictionary.set(kValueAt, -3));
    EXPECT_EQ(copy(*dictionary.read(kValueAt)), encoded(row, -3));
    EXPECT_EQ(load_le_signed(*dictionary.read(kValueAt)), -3);
    ASSERT_TRUE(dictionary.set(kValueAt, 3));
    EXPECT_EQ(load_le_signed(*dictionary.read(kValueAt)), 3);
  }
}

TEST(Values, AreRememberedAsDescribed) {
  Dictionary dictionary;
  ASSERT_TRUE(dictionary.add(var(kValueAt.index, DataType::unsigned16, bytes({1, 2}))));
  ASSERT_EQ(dictionary.write(kValueAt, bytes({3, 4})), AbortCode::none);
  EXPECT_EQ(copy(dictionary.initial_value(kValueAt)), bytes({1, 2}));
  EXPECT_TRUE(dictionary.initial_value({0x2001, 0}).empty());
}

TEST(StoreFlag, IsAsDescribedUntilItIsSet) {  // 1010h: which values 1010h saves
  ObjectDescription record =
      object(0x2000, ObjectType::record,
             {variable(0, DataType::unsigned8), variable(2, DataType::unsigned8),
              variable(4, DataType::unsigned8)});
  record.variables[1].store = true;
  Dictionary dictionary;
  std::byte place{};
  ASSERT_TRUE(dictionary.add(record));
  ASSERT_TRUE(dictionary.add(var(0x1017, DataType::unsigned16)));
  ASSERT_TRUE(dictionary.add_window(0xA040, DataType::unsigned8, Access::rww, &place, 1));
  using List = std::vector<Address>;
  EXPECT_EQ(dictionary.stored(0, 0xFFFF), (List{{0x2000, 2}}));
  ASSERT_TRUE(dictionary.set_store({0x1017, 0}, true));
  ASSERT_TRUE(dictionary.set_store({0x2000, 4}, true));
  EXPECT_EQ(dictionary.stored(0, 0xFFFF), (List{{0x1017, 0}, {0x2000, 2}, {0x2000, 4}}));
  EXPECT_EQ(dictionary.stored(0x1000, 0x1FFF), (List{{0x1017, 0}}));
  ASSERT_TRUE(dictionary.set_store({0x2000, 2}, false));
  EXPECT_EQ(dictionary.stored(0x2000, 0x2000), (List{{0x2000, 4}}));
  EXPECT_EQ(dictionary.set_store({0x2000, 3}, true).error(), to_error(AbortCode::no_sub_index));
  EXPECT_EQ(dictionary.set_store({0x2001, 0}, true).error(), to_error(AbortCode::no_object));
  EXPECT_EQ(dictionary.set_store({0xA040, 1}, true).error(),
            to_error(AbortCode::unsupported_access));
}

}  // namespace
}  // namespace linegate::od
