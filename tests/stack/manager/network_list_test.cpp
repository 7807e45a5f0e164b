// SPDX-License-Identifier: Apache-2.0
#include "stack/manager/network_list.h"

#include <gtest/gtest.h>

#include "stack/od/objects.h"

namespace linegate::manager {
namespace {

using std::chrono::milliseconds;

NodePlan plan(std::uint8_t id) {
  NodePlan out;
  out.id = id;
  return out;
}

od::Dictionary dictionary_of(const std::vector<NodePlan>& plans, const Options& options = {}) {
  od::DeviceDescription device;
  device.objects = network_objects(plans, options);
  return od::Dictionary(device);
}

TEST(NetworkList, EachObjectIsThereWithItsElements) {
  const od::Dictionary dictionary = dictionary_of({});
  for (const std::uint16_t index :
       {od::objects::kSlaveAssignment, od::objects::kExpectedDeviceType,
        od::objects::kExpectedVendor, od::objects::kExpectedProduct, od::objects::kExpectedRevision,
        od::objects::kExpectedSerial, od::objects::kRestoreConfiguration}) {
    EXPECT_EQ(dictionary.highest_sub(index), 127) << index;
    EXPECT_EQ(dictionary.number({index, 0}), 127U) << index;
  }
  EXPECT_EQ(dictionary.number({od::objects::kRequestNmt, 0}), 128U);
  EXPECT_EQ(dictionary.number({od::objects::kRequestGuarding, 0}), 128U);
  EXPECT_EQ(dictionary.find({od::objects::kNmtStartup, 0})->size, 4U);
  EXPECT_EQ(dictionary.find({od::objects::kBootTime, 0})->size, 4U);
  EXPECT_EQ(dictionary.find({od::objects::kNmtInhibitTime, 0})->size, 2U);
  EXPECT_EQ(dictionary.find({od::objects::kRestoreConfiguration, 1})->size, 1U);
}

TEST(NetworkList, AnUnlistedNodeHasNoBits) {
  const od::Dictionary dictionary = dictionary_of({plan(5)});
  const NetworkList list(dictionary);
  EXPECT_EQ(list.assignment(5), 0x05U) << "listed, to be booted";
  EXPECT_EQ(list.assignment(6), 0U);
  EXPECT_TRUE(list.listed(5));
  EXPECT_FALSE(list.listed(6));
  EXPECT_FALSE(list.mandatory(5));
}

TEST(NetworkList, EachBitOf1F81hComesFromThePlan) {  // 1F81h; 1F8Ah, 1011h
  std::vector<NodePlan> plans = {plan(1), plan(2), plan(3), plan(4), plan(5)};
  plans[0].boot = false;
  plans[1].mandatory = true;
  plans[2].keep_alive = true;
  plans[3].restore = 2;
  plans[4].guard_time = milliseconds(0x1234);
  plans[4].life_time_factor = 3;
  const od::Dictionary dictionary = dictionary_of(plans);
  const NetworkList list(dictionary);
  EXPECT_EQ(list.assignment(1), 0x01U);
  EXPECT_EQ(list.assignment(2), 0x0DU);
  EXPECT_EQ(list.assignment(3), 0x15U);
  EXPECT_EQ(list.assignment(4), 0x85U);
  EXPECT_EQ(list.assignment(5), 0x1234'0305U);
  EXPECT_TRUE(list.mandatory(2));
  EXPECT_EQ(list.restore(4), 2);
  EXPECT_EQ(list.guard_time(5), milliseconds(0x1234));
  EXPECT_EQ(list.life_time_factor(5), 3);
}

TEST(NetworkList, WhatIsExpectedComesFromThePlan) {  // 1F84h
  NodePlan node = plan(9);
  node.device_type = 1;
  node.vendor = 2;
  node.product = 3;
  node.revision = 4;
  node.serial = 5;
  const od::Dictionary dictionary = dictionary_of({node});
  const NetworkList list(dictionary);
  for (std::uint16_t i = 0; i < 5; ++i) {
    EXPECT_EQ(list.expected(static_cast<std::uint16_t>(od::objects::kExpectedDeviceType + i), 9),
              i + 1U);
    EXPECT_EQ(list.expected(static_cast<std::uint16_t>(od::objects::kExpectedDeviceType + i), 8),
              0U);
  }
}

TEST(NetworkList, EachBitOf1F80hComesFromTheOptions) {
  const auto startup = [](const Options& options) {
    const od::Dictionary dictionary = dictionary_of({}, options);
    return NetworkList(dictionary).startup();
  };
  EXPECT_EQ(startup({}), 0x01U);
  EXPECT_EQ(startup({.master = false}), 0x00U);
  EXPECT_EQ(startup({.start_all = true}), 0x03U);
  EXPECT_EQ(startup({.own_start = false}), 0x05U);
  EXPECT_EQ(startup({.start_nodes = false}), 0x09U);
  EXPECT_EQ(startup({.on_error = ErrorReaction::reset_all}), 0x11U);
  EXPECT_EQ(startup({.on_error = ErrorReaction::stop_all}), 0x41U);
}

TEST(NetworkList, TimesAreInTheirUnits) {
  const od::Dictionary dictionary =
      dictionary_of({}, {.boot_time = milliseconds(30'000), .nmt_inhibit = milliseconds(2)});
  EXPECT_EQ(dictionary.number({od::objects::kBootTime, 0}), 30'000U) << "ms";
  EXPECT_EQ(dictionary.number({od::objects::kNmtInhibitTime, 0}), 20U) << "100 us";
  EXPECT_EQ(NetworkList(dictionary).boot_time(), milliseconds(30'000));
}

TEST(NetworkList, ReadsWhatIsWritten) {
  od::Dictionary dictionary = dictionary_of({plan(5)});
  const NetworkList list(dictionary);
  ASSERT_TRUE(dictionary.set({od::objects::kSlaveAssignment, 7}, std::uint32_t{0x0D}));
  EXPECT_TRUE(list.mandatory(7));
}

}  // namespace
}  // namespace linegate::manager
