// SPDX-License-Identifier: Apache-2.0
#include "stack/sync/parameters.h"

#include <gtest/gtest.h>

#include "stack/od/objects.h"
#include "stack/sync/service.h"

#include "tests/stack/node/objects.h"

namespace linegate::sync {
namespace {

using testing::write;

class SyncObjectsTest : public ::testing::Test {
 protected:
  SyncObjectsTest() {
    for (const std::uint16_t index :
         {od::objects::kSyncCobId, od::objects::kSyncPeriod, od::objects::kSyncCounterOverflow}) {
      EXPECT_TRUE(dictionary.set_hook(index, &service).ok());
    }
    service.configure();
  }

  AbortCode cob_id(std::uint32_t value) {
    return write<std::uint32_t>(dictionary, {od::objects::kSyncCobId, 0}, value);
  }
  AbortCode period(std::uint32_t us) {
    return write<std::uint32_t>(dictionary, {od::objects::kSyncPeriod, 0}, us);
  }
  AbortCode overflow(std::uint8_t value) {
    return write<std::uint8_t>(dictionary, {od::objects::kSyncCounterOverflow, 0}, value);
  }

  od::Dictionary dictionary = testing::dictionary_of(
      {testing::object(od::objects::kSyncCobId, od::DataType::unsigned32, 0x80),
       testing::object(od::objects::kSyncPeriod, od::DataType::unsigned32, 0),
       testing::object(od::objects::kSyncCounterOverflow, od::DataType::unsigned8, 0)});
  can::Dispatch dispatch;
  can::TransmitQueue transmit;
  EventLog events;
  Service service{dictionary, dispatch, transmit, events};
};

TEST_F(SyncObjectsTest, TheCanIdChangesOnlyWhileNotProducing) {  // 1005h
  EXPECT_EQ(cob_id(0x81), AbortCode::none);
  EXPECT_EQ(cob_id(0x4000'0081), AbortCode::none);
  EXPECT_EQ(cob_id(0x4000'0082), AbortCode::invalid_value);
  EXPECT_EQ(cob_id(0x0000'0082), AbortCode::invalid_value);
  EXPECT_EQ(cob_id(0x6000'0081), AbortCode::invalid_value);
  EXPECT_EQ(cob_id(0x0000'0081), AbortCode::none);
  EXPECT_EQ(cob_id(0x0000'0082), AbortCode::none);
}

TEST_F(SyncObjectsTest, WithoutACyclePeriodTheProducerBitIsRefused) {
  ASSERT_TRUE(dictionary.remove(od::objects::kSyncPeriod).ok());
  EXPECT_EQ(cob_id(0x4000'0080), AbortCode::invalid_value);
  EXPECT_EQ(cob_id(0x0000'0081), AbortCode::none);
}

TEST_F(SyncObjectsTest, RestrictedCanIdsAreRefused) {
  for (const std::uint32_t id : {0x000U, 0x001U, 0x07FU, 0x101U, 0x180U, 0x581U, 0x5FFU, 0x601U,
                                 0x67FU, 0x6E0U, 0x6FFU, 0x701U, 0x780U, 0x7FFU}) {
    EXPECT_EQ(cob_id(id), AbortCode::invalid_value) << id;
  }
  EXPECT_EQ(cob_id(0x0000'0800), AbortCode::invalid_value);
  EXPECT_EQ(cob_id(0x2000'0801), AbortCode::none);
}

TEST_F(SyncObjectsTest, CounterOverflowValues) {
  for (const int value : {2, 240, 0}) {
    EXPECT_EQ(overflow(static_cast<std::uint8_t>(value)), AbortCode::none) << value;
  }
  for (const int value : {1, 241, 255}) {
    EXPECT_EQ(overflow(static_cast<std::uint8_t>(value)), AbortCode::invalid_value) << value;
  }
}

TEST_F(SyncObjectsTest, CounterOverflowChangesOnlyWithoutPeriod) {
  EXPECT_EQ(overflow(10), AbortCode::none);
  EXPECT_EQ(period(1000), AbortCode::none);
  EXPECT_EQ(overflow(20), AbortCode::device_state);
  EXPECT_EQ(overflow(10), AbortCode::none);
  EXPECT_EQ(period(0), AbortCode::none);
  EXPECT_EQ(overflow(20), AbortCode::none);
}

TEST_F(SyncObjectsTest, TheConsumerFollowsTheCobId) {
  EXPECT_NE(dispatch.find(can::make_frame(0x80, {})), nullptr);
  cob_id(0x81);
  EXPECT_EQ(dispatch.find(can::make_frame(0x80, {})), nullptr);
  EXPECT_NE(dispatch.find(can::make_frame(0x81, {})), nullptr);
  cob_id(0x4000'0081);
  EXPECT_EQ(dispatch.find(can::make_frame(0x81, {})), nullptr);
}

TEST(SyncParameters, WithoutTheObjectThereIsNoSync) {
  const Parameters parameters = read_parameters(od::Dictionary{});
  EXPECT_FALSE(parameters.exists);
  EXPECT_FALSE(parameters.is_producer());
}

}  // namespace
}  // namespace linegate::sync
