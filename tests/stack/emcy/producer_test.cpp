// SPDX-License-Identifier: Apache-2.0
#include "stack/emcy/producer.h"

#include <gtest/gtest.h>

#include "stack/od/objects.h"

#include "tests/stack/node/objects.h"

namespace linegate::emcy {
namespace {

using namespace std::chrono_literals;
using testing::at;
using testing::data_of;
using testing::pop_events;
using testing::pop_frames;
using testing::write;

constexpr std::byte kInfo[] = {std::byte{0xA1}, std::byte{0xA2}, std::byte{0xA3}, std::byte{0xA4},
                               std::byte{0xA5}};

class EmcyProducerTest : public ::testing::Test {
 protected:
  EmcyProducerTest() {
    EXPECT_TRUE(dictionary.set_hook(od::objects::kErrorHistory, &producer.history()).ok());
    EXPECT_TRUE(dictionary.set_hook(od::objects::kEmcyCobId, &producer).ok());
    EXPECT_TRUE(dictionary.set_hook(od::objects::kEmcyInhibitTime, &producer).ok());
    producer.set_active(true);
  }

  SendResult send(std::uint16_t code, Duration when, std::uint8_t error_register = 0x01) {
    return producer.send(code, error_register, kInfo, at(when));
  }
  std::optional<std::uint32_t> history(std::uint8_t sub) {
    const auto value = dictionary.read({od::objects::kErrorHistory, sub});
    return value ? std::optional(static_cast<std::uint32_t>(load_le(*value))) : std::nullopt;
  }
  void inhibit(std::uint16_t units) {
    EXPECT_EQ(write<std::uint16_t>(dictionary, {od::objects::kEmcyInhibitTime, 0}, units),
              AbortCode::none);
  }
  AbortCode cob_id(std::uint32_t raw) {
    return write<std::uint32_t>(dictionary, {od::objects::kEmcyCobId, 0}, raw);
  }

  od::Dictionary dictionary = testing::dictionary_of(
      {testing::object(od::objects::kErrorRegister, od::DataType::unsigned8, 0, od::Access::ro),
       testing::array(od::objects::kErrorHistory, od::DataType::unsigned32, 3, 0,
                      testing::sub(0, od::DataType::unsigned8, 0)),
       testing::object(od::objects::kEmcyCobId, od::DataType::unsigned32, 0x85),
       testing::object(od::objects::kEmcyInhibitTime, od::DataType::unsigned16, 0)});
  can::TransmitQueue queue;
  EventLog events;
  Producer producer{dictionary, queue, events, 5};
};

TEST_F(EmcyProducerTest, SendsEightBytes) {  // 1014h
  EXPECT_EQ(send(0x6200, 0ms, 0x81), SendResult::sent);
  const auto frames = pop_frames(queue);
  ASSERT_EQ(frames.size(), 1U);
  EXPECT_EQ(frames[0].id, 0x85U);
  EXPECT_EQ(data_of(frames[0]), (std::vector<int>{0x00, 0x62, 0x81, 0xA1, 0xA2, 0xA3, 0xA4, 0xA5}));
  EXPECT_EQ(dictionary.number({od::objects::kErrorRegister, 0}), 0x81U);
  const auto told = pop_events(events);
  ASSERT_EQ(told.size(), 1U);
  EXPECT_EQ(told[0].node, 5);
  EXPECT_EQ(std::get<event::EmcySent>(told[0].data).code, 0x6200U);
}

TEST_F(EmcyProducerTest, MayBeOneOfCanopenFd) {
  ASSERT_TRUE(
      dictionary
          .add(testing::object(od::objects::kDeviceType, od::DataType::unsigned32, 0x0002'0192))
          .ok());
  producer.be_fd([](Instant now) {
    return std::array<std::byte, 6>{now == at(1ms) ? std::byte{7} : std::byte{0}};
  });
  EXPECT_EQ(send(0x6200, 1ms, 0x81), SendResult::sent);
  EXPECT_EQ(send(0x0000, 2ms, 0x00), SendResult::sent);
  EXPECT_EQ(producer.relay({.code = 0x1000}, at(3ms)), SendResult::sent);
  const auto frames = pop_frames(queue);
  ASSERT_EQ(frames.size(), 3U);
  const auto error = decode_fd(frames[0]);
  ASSERT_TRUE(error);
  EXPECT_EQ(
      error->fd,
      (event::FdEmcy{
          .any = true, .status = kStatusActive, .profile = 402, .time_of_day = {std::byte{7}}}));
  EXPECT_EQ(error->info[4], kInfo[4]);
  EXPECT_EQ(decode_fd(frames[1])->fd.status, 0);
  EXPECT_TRUE(decode(frames[2])) << "of another network: as it was received";
  EXPECT_EQ(history(1), 0xA2A1'6200U);
  EXPECT_TRUE(std::get<event::EmcySent>(pop_events(events)[0].data).fd.any);
}

TEST_F(EmcyProducerTest, MissingManufacturerBytesAreZeroAndMoreAreLeftOut) {
  EXPECT_EQ(producer.send(0x6200, 0x81, {}, at(0ms)), SendResult::sent);
  const std::array<std::byte, 7> seven{std::byte{1}, std::byte{2}, std::byte{3}, std::byte{4},
                                       std::byte{5}, std::byte{6}, std::byte{7}};
  EXPECT_EQ(producer.send(0x6200, 0x81, seven, at(0ms)), SendResult::sent);
  const auto frames = pop_frames(queue);
  ASSERT_EQ(frames.size(), 2U);
  EXPECT_EQ(data_of(frames[0]), (std::vector<int>{0x00, 0x62, 0x81, 0, 0, 0, 0, 0}));
  EXPECT_EQ(data_of(frames[1]), (std::vector<int>{0x00, 0x62, 0x81, 1, 2, 3, 4, 5}));
}

TEST_F(EmcyProducerTest, HistoryNewestFirst) {
  EXPECT_EQ(history(0), 0U);
  EXPECT_FALSE(history(1));
  send(0x1000, 0ms);
  send(0x2000, 1ms);
  EXPECT_EQ(history(0), 2U);
  EXPECT_EQ(history(1), 0xA2A1'2000U);
  EXPECT_EQ(history(2), 0xA2A1'1000U);
  EXPECT_EQ(dictionary.read({od::objects::kErrorHistory, 3}).error(), to_error(AbortCode::no_data));
  send(0x3000, 2ms);
  send(0x4000, 3ms);
  EXPECT_EQ(history(0), 3U);
  EXPECT_EQ(history(1), 0xA2A1'4000U);
  EXPECT_EQ(history(3), 0xA2A1'2000U);
}

TEST_F(EmcyProducerTest, ErrorResetClearsTheRegisterAndIsNoError) {
  send(0x1000, 0ms);
  EXPECT_EQ(producer.send(kErrorReset, 0, {}, at(1ms)), SendResult::sent);
  EXPECT_EQ(producer.error_register(), 0);
  EXPECT_EQ(history(0), 1U);
  EXPECT_EQ(data_of(pop_frames(queue)[1]), (std::vector<int>(8, 0)));
}

TEST_F(EmcyProducerTest, WritingZeroEmptiesTheHistory) {
  send(0x1000, 0ms);
  EXPECT_EQ(write<std::uint8_t>(dictionary, {od::objects::kErrorHistory, 0}, 1),
            AbortCode::invalid_value);
  EXPECT_EQ(history(0), 1U);
  EXPECT_EQ(write<std::uint8_t>(dictionary, {od::objects::kErrorHistory, 0}, 0), AbortCode::none);
  EXPECT_EQ(history(0), 0U);
  EXPECT_FALSE(history(1));
}

TEST_F(EmcyProducerTest, TheInhibitTimeSpacesMessages) {
  inhibit(100);  // 10 ms, 1015h
  EXPECT_EQ(send(0x1000, 0ms), SendResult::sent);
  EXPECT_EQ(send(0x2000, 4ms), SendResult::queued);
  EXPECT_EQ(send(0x3000, 5ms), SendResult::queued);
  EXPECT_EQ(pop_frames(queue).size(), 1U);
  EXPECT_EQ(producer.next_wake(), at(10ms));
  producer.advance(at(9ms));
  EXPECT_TRUE(queue.empty());
  producer.advance(at(10ms));
  const auto second = pop_frames(queue);
  ASSERT_EQ(second.size(), 1U);
  EXPECT_EQ(data_of(second[0])[1], 0x20);
  EXPECT_EQ(producer.next_wake(), at(20ms));
  producer.advance(at(20ms));
  EXPECT_EQ(pop_frames(queue).size(), 1U);
  EXPECT_EQ(producer.next_wake(), kNever);
}

TEST_F(EmcyProducerTest, InhibitedWhenTooManyWait) {
  inhibit(100);
  EXPECT_EQ(send(0x1000, 0ms), SendResult::sent);
  for (std::size_t i = 0; i < Producer::kWaiting; ++i) {
    EXPECT_EQ(send(0x1000, 1ms), SendResult::queued);
  }
  EXPECT_EQ(send(0x1000, 1ms), SendResult::inhibited);
}

TEST_F(EmcyProducerTest, InhibitedWhenTheBusTakesNothing) {
  SendResult last = SendResult::sent;
  for (int i = 0; i < 1000; ++i) {
    last = send(0x1000, i * 1ms);
  }
  EXPECT_EQ(last, SendResult::inhibited);
}

TEST_F(EmcyProducerTest, DisabledByCobIdOrState) {
  EXPECT_EQ(cob_id(0x8000'0085), AbortCode::none);
  EXPECT_EQ(send(0x1000, 0ms), SendResult::disabled);
  EXPECT_EQ(cob_id(0x0000'0085), AbortCode::none);
  producer.set_active(false);
  EXPECT_EQ(send(0x2000, 0ms), SendResult::disabled);
  EXPECT_TRUE(queue.empty());
  EXPECT_EQ(history(0), 2U);
}

TEST_F(EmcyProducerTest, CobIdRules) {
  EXPECT_EQ(cob_id(0x0000'0086), AbortCode::invalid_value);
  EXPECT_EQ(cob_id(0x0000'0085), AbortCode::none);
  EXPECT_EQ(cob_id(0x8000'0000), AbortCode::none);
  EXPECT_EQ(cob_id(0x0000'0000), AbortCode::invalid_value);
  EXPECT_EQ(cob_id(0x0000'0601), AbortCode::invalid_value);
  EXPECT_EQ(cob_id(0x0000'0886), AbortCode::invalid_value);
  EXPECT_EQ(cob_id(0x0000'0086), AbortCode::none);
  EXPECT_EQ(send(0x1000, 0ms), SendResult::sent);
  EXPECT_EQ(pop_frames(queue)[0].id, 0x86U);
}

TEST_F(EmcyProducerTest, WhatWaitsIsForgottenWithTheCobId) {
  inhibit(100);
  send(0x1000, 0ms);
  send(0x1000, 0ms);
  cob_id(0x8000'0085);
  EXPECT_EQ(producer.next_wake(), kNever);
}

TEST(EmcyProducer, WorksWithoutItsOptionalObjects) {
  od::Dictionary dictionary = testing::dictionary_of(
      {testing::object(od::objects::kEmcyCobId, od::DataType::unsigned32, 0x85)});
  can::TransmitQueue queue;
  EventLog events;
  Producer producer(dictionary, queue, events, 5);
  producer.set_active(true);
  EXPECT_EQ(producer.send(0x1000, 0x01, {}, at(0ms)), SendResult::sent);
}

}  // namespace
}  // namespace linegate::emcy
