// SPDX-License-Identifier: Apache-2.0
#include "stack/nmt/consumer_heartbeat_time.h"

#include <gtest/gtest.h>

#include "stack/base/byte_order.h"
#include "stack/od/objects.h"

#include "tests/stack/node/objects.h"

namespace linegate::nmt {
namespace {

using namespace std::chrono_literals;
using testing::at;
using testing::frame_at;
using testing::write;

class ConsumerHeartbeatTimeTest : public ::testing::Test {
 protected:
  ConsumerHeartbeatTimeTest() {
    EXPECT_TRUE(dictionary.set_hook(od::objects::kConsumerHeartbeatTime, &object).ok());
  }

  AbortCode set(std::uint8_t sub, std::uint32_t value) {
    return write<std::uint32_t>(dictionary, {od::objects::kConsumerHeartbeatTime, sub}, value);
  }

  od::Dictionary dictionary = testing::dictionary_of(
      {testing::array(od::objects::kConsumerHeartbeatTime, od::DataType::unsigned32, 4)});
  can::Dispatch dispatch;
  EventLog events;
  HeartbeatConsumer consumer{dispatch, events};
  ConsumerHeartbeatTime object{dictionary, consumer};
};

TEST_F(ConsumerHeartbeatTimeTest, AWriteTakesEffectAtOnce) {
  EXPECT_EQ(set(1, 0x0005'00FA), AbortCode::none);
  EXPECT_EQ(consumer.time(5), 250ms);
  EXPECT_EQ(set(1, 0), AbortCode::none);
  EXPECT_FALSE(consumer.monitored(5));
  EXPECT_EQ(dispatch.find(frame_at(at(0ms), 0x705, {5})), nullptr);
}

TEST_F(ConsumerHeartbeatTimeTest, TheSameNodeTwiceIsRefused) {
  EXPECT_EQ(set(1, 0x0005'00FA), AbortCode::none);
  EXPECT_EQ(set(2, 0x0005'0064), AbortCode::parameter_incompatible);
  EXPECT_EQ(set(1, 0x0005'0064), AbortCode::none);
  EXPECT_EQ(set(2, 0x0005'0000), AbortCode::none);
  EXPECT_EQ(set(2, 0x0006'0064), AbortCode::none);
  EXPECT_EQ(consumer.time(5), 100ms);
  EXPECT_EQ(consumer.time(6), 100ms);
}

TEST_F(ConsumerHeartbeatTimeTest, WhatAnotherConsumerMonitorsIsShownInEntriesThatAreNotUsed) {
  HeartbeatConsumer managers{dispatch, events, 128};
  managers.monitor(7, 250ms);
  managers.monitor(9, 100ms);
  object.show(&managers);
  const auto shown = [this](std::uint8_t sub) {
    const auto value = dictionary.read({od::objects::kConsumerHeartbeatTime, sub});
    return value.ok() ? load_le(*value) : 0;
  };
  EXPECT_EQ(set(2, 0x0005'00FA), AbortCode::none);
  EXPECT_EQ(shown(1), 0x0007'00FAU);
  EXPECT_EQ(shown(2), 0x0005'00FAU);
  EXPECT_EQ(shown(3), 0x0009'0064U);
  EXPECT_EQ(shown(4), 0U);
  EXPECT_FALSE(consumer.monitored(7)) << "monitored by the other consumer";
  EXPECT_EQ(set(3, 0x0007'0064), AbortCode::none) << "node 7 has another entry";
  EXPECT_EQ(consumer.time(7), 100ms);
  EXPECT_EQ(shown(1), 0x0009'0064U);
  EXPECT_TRUE(object.shows());
  object.hide(dictionary);
  EXPECT_FALSE(object.shows());
  EXPECT_EQ(dictionary.number({od::objects::kConsumerHeartbeatTime, 1}), 0U)
      << "hidden values are not stored";
  EXPECT_EQ(dictionary.number({od::objects::kConsumerHeartbeatTime, 2}), 0x0005'00FAU);
  managers.stop(9);
  EXPECT_EQ(shown(1), 0U);
}

TEST_F(ConsumerHeartbeatTimeTest, NodeIdsOutOfRangeAreNotUsed) {
  EXPECT_EQ(set(1, 0x0000'0064), AbortCode::none);
  EXPECT_EQ(set(2, 0x0080'0064), AbortCode::none);
  EXPECT_EQ(set(3, 0x00FF'0064), AbortCode::none);
  EXPECT_EQ(set(4, 0x00FF'0064), AbortCode::none);
  EXPECT_EQ(consumer.next_wake(), kNever);
}

TEST_F(ConsumerHeartbeatTimeTest, OtherNodesAreMonitoredOn) {
  set(1, 0x0005'0064);
  consumer.receive(5, frame_at(at(0ms), 0x705, {5}));
  set(2, 0x0006'0064);
  EXPECT_EQ(consumer.next_wake(), at(100ms));
  object.configure(true);
  EXPECT_EQ(consumer.next_wake(), kNever);
  EXPECT_TRUE(consumer.monitored(5));
}

}  // namespace
}  // namespace linegate::nmt
