// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <random>

#include <gtest/gtest.h>

#include "tests/stack/od/objects.h"

namespace linegate::od {
namespace {

using test::bytes;
using test::object;
using test::var;
using test::variable;

TEST(LookUp, TellsMissingObjectsFromMissingSubIndices) {
  Dictionary dictionary;
  ASSERT_TRUE(dictionary.add(
      object(0x1800, ObjectType::record,
             {variable(0, DataType::unsigned8, bytes({5})), variable(1, DataType::unsigned32),
              variable(5, DataType::unsigned16)})));
  AbortCode why = AbortCode::none;
  EXPECT_FALSE(dictionary.find({0x1801, 0}, &why));
  EXPECT_EQ(why, AbortCode::no_object);
  EXPECT_FALSE(dictionary.find({0x2000, 0}, &why));
  EXPECT_EQ(why, AbortCode::no_object);
  for (const std::uint8_t sub : std::initializer_list<std::uint8_t>{2, 3, 4, 6, 255}) {
    why = AbortCode::none;
    EXPECT_FALSE(dictionary.find({0x1800, sub}, &why));
    EXPECT_EQ(why, AbortCode::no_sub_index) << unsigned{sub};
  }
  EXPECT_FALSE(dictionary.find({0x1800, 2}));
  EXPECT_EQ(dictionary.find({0x1800, 5})->type, DataType::unsigned16);
  EXPECT_EQ(dictionary.highest_sub(0x1800), 5);
  EXPECT_EQ(dictionary.highest_sub(0x1801), std::nullopt);
}

TEST(LookUp, FindsEveryOfTenThousandObjects) {
  std::vector<std::uint16_t> order(10'000);
  for (std::size_t i = 0; i < order.size(); ++i) {
    order[i] = static_cast<std::uint16_t>(0x2000 + i);
  }
  std::shuffle(order.begin(), order.end(), std::mt19937(1));
  Dictionary dictionary;
  for (const std::uint16_t index : order) {
    ASSERT_TRUE(dictionary.add(var(index, DataType::unsigned32)));
    ASSERT_TRUE(dictionary.set({index, 0}, index * 3U));
  }
  for (const std::uint16_t index : order) {
    EXPECT_EQ(dictionary.number({index, 0}), index * 3U);
  }
  std::sort(order.begin(), order.end());
  EXPECT_EQ(dictionary.indices(), order);
}

TEST(LookUp, ReachesTheFirstAndTheLastIndex) {
  Dictionary dictionary;
  ASSERT_TRUE(dictionary.add(var(0x0001, DataType::boolean)));
  ASSERT_TRUE(dictionary.add(var(0xFFFF, DataType::unsigned64)));
  EXPECT_TRUE(dictionary.has_object(0x0001));
  EXPECT_TRUE(dictionary.has_object(0xFFFF));
  EXPECT_FALSE(dictionary.has_object(0x0000));
  EXPECT_FALSE(dictionary.has_object(0xFFFE));
}

TEST(LookUp, NamesAndTypesAreThoseOfTheDescription) {
  ObjectDescription identity =
      object(0x1018, ObjectType::record,
             {variable(0, DataType::unsigned8), variable(1, DataType::unsigned32)});
  identity.name = "Identity";
  identity.variables[1].name = "Vendor-ID";
  ObjectDescription device_type = var(0x1000, DataType::unsigned32);
  device_type.name = "Device type";
  Dictionary dictionary;
  ASSERT_TRUE(dictionary.add(identity));
  ASSERT_TRUE(dictionary.add(device_type));
  EXPECT_EQ(dictionary.name({0x1000, 0}), "Device type");
  EXPECT_EQ(dictionary.name({0x1018, 0}), "Identity");
  EXPECT_EQ(dictionary.name({0x1018, 1}), "Vendor-ID");
  EXPECT_EQ(dictionary.name({0x1018, 2}), "");
  EXPECT_EQ(dictionary.name({0x1019, 0}), "");
  EXPECT_EQ(dictionary.object_type(0x1018), ObjectType::record);
  EXPECT_EQ(dictionary.object_type(0x1000), ObjectType::variable);
  EXPECT_EQ(dictionary.object_type(0x1019), ObjectType::null);
}

TEST(LookUp, TheHotPartOfAVariableIsSmall) {
  EXPECT_LE(sizeof(Variable), 40U);
}

TEST(DeviceDescription, IsSearchedByAddress) {
  DeviceDescription device;
  device.objects = {var(0x1000, DataType::unsigned32),
                    object(0x1018, ObjectType::record,
                           {variable(0, DataType::unsigned8), variable(4, DataType::unsigned32)})};
  EXPECT_EQ(device.find(0x1018), &device.objects[1]);
  EXPECT_EQ(device.find(0x1001), nullptr);
  EXPECT_EQ(device.find(0x2000), nullptr);
  EXPECT_EQ(device.find({0x1018, 4}), &device.objects[1].variables[1]);
  EXPECT_EQ(device.find({0x1018, 3}), nullptr);
  EXPECT_EQ(device.find({0x1018, 5}), nullptr);
  EXPECT_EQ(device.find({0x1019, 0}), nullptr);
}

}  // namespace
}  // namespace linegate::od
