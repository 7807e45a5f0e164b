// SPDX-License-Identifier: Apache-2.0
#include "stack/scan/describe.h"

#include <gtest/gtest.h>

#include "stack/base/byte_order.h"
#include "stack/manager/plan.h"

#include "tests/stack/scan/answers.h"

namespace linegate::scan {
namespace {

using test::Answers;

Answers drive() {
  Answers out;
  out.set(0x1000, 0, 0x0002'0192, 4);
  out.set(0x1018, 0, 3, 1);
  out.set(0x1018, 1, 0x1234, 4);
  out.set(0x1018, 2, 0x77, 4);
  out.set(0x1018, 3, 0x0001'0002, 4);
  out.set(0x1017, 0, 100, 2);
  out.set_pdo(0x1400, 0x205, 255, {0x6040'0010, 0x0005'0008, 0x607A'0020});
  out.set_pdo(0x1800, 0x185, 1, {0x6041'0010, 0x6000'0201, 0x2100'0348});
  return out;
}

std::uint64_t value(const od::DeviceDescription& device, od::Address address) {
  const auto* variable = device.find(address);
  return variable == nullptr ? ~0ULL : load_le(std::span<const std::byte>(variable->value));
}

TEST(Describe, GivesTheIdentityAndCiAsNamesAndTypes) {
  const od::DeviceDescription device = describe(drive().survey(5));
  EXPECT_EQ(device.node_id, 5);
  EXPECT_EQ(device.vendor_number, 0x1234U);
  EXPECT_EQ(device.product_number, 0x77U);
  ASSERT_NE(device.find({0x1017, 0}), nullptr);
  EXPECT_EQ(device.find({0x1017, 0})->name, "Producer heartbeat time");
  EXPECT_EQ(device.find({0x1017, 0})->type, od::DataType::unsigned16);
  EXPECT_EQ(value(device, {0x1017, 0}), 100U);
}

// A scan report comes over the network and may contain any values.
TEST(Describe, NamesParametersThatCiA301DoesNotKnow) {
  Answers answers = drive();
  ScannedNode node = answers.survey(5);
  for (const std::uint8_t sub : {std::uint8_t{6}, std::uint8_t{7}, std::uint8_t{255}}) {
    node.values.push_back({{0x1800, sub}, {std::byte{1}}});
  }
  const od::DeviceDescription device = describe(node);
  EXPECT_EQ(device.find({0x1800, 6})->name, "SYNC start value");
  EXPECT_EQ(device.find({0x1800, 7})->name, "Parameter 7");
  EXPECT_EQ(device.find({0x1800, 255})->name, "Parameter 255");
}

TEST(Describe, MakesAnObjectOfWhatIsMappedByItsLengthAndDirection) {
  const od::DeviceDescription device = describe(drive().survey(5));
  const auto* status = device.find({0x6041, 0});
  ASSERT_NE(status, nullptr);
  EXPECT_EQ(status->type, od::DataType::unsigned16);
  EXPECT_EQ(status->access, od::Access::ro);
  EXPECT_TRUE(status->mappable);
  EXPECT_EQ(device.find({0x6000, 2})->type, od::DataType::boolean);
  EXPECT_EQ(device.find({0x2100, 3})->type, od::DataType::octet_string) << "72 bit";
  const auto* target = device.find({0x607A, 0});
  ASSERT_NE(target, nullptr);
  EXPECT_EQ(target->type, od::DataType::unsigned32);
  EXPECT_EQ(target->access, od::Access::rww);
}

TEST(Describe, TakesFillersOfAnRpdoForDummyTypes) {
  const od::DeviceDescription device = describe(drive().survey(5));
  EXPECT_EQ(device.dummy_types, 1U << 5U);
  EXPECT_EQ(device.find(std::uint16_t{5}), nullptr);
}

TEST(Describe, RecordsHaveASubIndexZero) {
  const od::DeviceDescription device = describe(drive().survey(5));
  EXPECT_EQ(value(device, {0x6000, 0}), 2U);
  EXPECT_EQ(device.find(0x6000)->type, od::ObjectType::record);
}

TEST(Describe, LeavesAManagerNothingToWrite) {
  EXPECT_TRUE(manager::configuration_writes(describe(drive().survey(5))).empty());
}

TEST(Merge, FindsTheFileByVendorProductAndMajorRevision) {
  const ScannedNode node = drive().survey(5);
  od::DeviceDescription file;
  file.vendor_number = 0x1234;
  file.product_number = 0x77;
  file.revision_number = 0x0001'0009;
  EXPECT_TRUE(matches(file, node));
  file.revision_number = 0x0002'0002;
  EXPECT_FALSE(matches(file, node));
  file.revision_number = 0;
  EXPECT_TRUE(matches(file, node)) << "no revision number in the file";
  file.product_number = 0x78;
  EXPECT_FALSE(matches(file, node));
  file = {};
  EXPECT_FALSE(matches(file, node)) << "a file without an identity";
}

TEST(Merge, AFileWithVendorIdZeroIsThatOfADeviceThatHasItToo) {
  ScannedNode node = drive().survey(5);
  od::DeviceDescription file;
  file.product_number = 0x77;
  EXPECT_FALSE(matches(file, node)) << "the device has a vendor-ID";
  const auto vendor =
      std::ranges::find(node.values, od::Address{0x1018, 1}, &manager::ObjectWrite::address);
  ASSERT_NE(vendor, node.values.end());
  std::ranges::fill(vendor->data, std::byte{0});
  EXPECT_TRUE(matches(file, node));
  file.product_number = 0x78;
  EXPECT_FALSE(matches(file, node)) << "another product";
  file.product_number = 0;
  EXPECT_FALSE(matches(file, node)) << "a file without an identity";
}

TEST(Merge, WhatDiffersFromTheFileBecomesAConfiguredValue) {
  const od::DeviceDescription file = describe(drive().survey(5));
  Answers changed = drive();
  changed.set(0x1017, 0, 250, 2);
  changed.set(0x1018, 3, 0x0001'0005, 4);
  const od::DeviceDescription merged = merge(file, changed.survey(5));
  EXPECT_TRUE(merged.find({0x1017, 0})->configured);
  EXPECT_EQ(value(merged, {0x1017, 0}), 250U);
  EXPECT_EQ(load_le(std::span<const std::byte>(merged.find({0x1017, 0})->notes.default_value)),
            100U);
  EXPECT_EQ(value(merged, {0x1018, 3}), 0x0001'0002U) << "read-only: from the file";
  EXPECT_FALSE(merged.find({0x1800, 1})->configured);
}

TEST(Merge, WhatTheFileDoesNotHaveIsAdded) {
  const od::DeviceDescription file = describe(drive().survey(5));
  Answers more = drive();
  more.set_pdo(0x1805, 0x385, 255, {0x6064'0020});
  const od::DeviceDescription merged = merge(file, more.survey(5));
  EXPECT_EQ(value(merged, {0x1805, 1}), 0x385U);
  EXPECT_NE(merged.find({0x6064, 0}), nullptr);
  for (std::size_t i = 1; i < merged.objects.size(); ++i) {
    EXPECT_LT(merged.objects[i - 1].index, merged.objects[i].index);
  }
}

}  // namespace
}  // namespace linegate::scan
