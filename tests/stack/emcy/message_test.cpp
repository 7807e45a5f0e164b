// SPDX-License-Identifier: Apache-2.0
#include "stack/emcy/message.h"

#include <gtest/gtest.h>

#include "tests/stack/node/objects.h"

namespace linegate::emcy {
namespace {

using testing::data_of;

constexpr Message kMessage{
    0x8210, 0x11, {std::byte{1}, std::byte{2}, std::byte{3}, std::byte{4}, std::byte{5}}};

TEST(EmcyMessage, Layout) {
  const can::Frame frame = encode(kMessage, can::CobId{0x85});
  EXPECT_EQ(frame.id, 0x85U);
  EXPECT_EQ(frame.flags, 0);
  EXPECT_EQ(data_of(frame), (std::vector<int>{0x10, 0x82, 0x11, 1, 2, 3, 4, 5}));
  EXPECT_EQ(decode(frame), kMessage);
}

// CiA 301, 7.2.7.1: the codes that a stack sends without the application.
TEST(EmcyMessage, CodesOfCia301) {
  const std::pair<std::uint16_t, std::uint16_t> table[] = {
      {kErrorReset, 0x0000},      {kDataSet, 0x6300},        {kOverrun, 0x8110},
      {kPassive, 0x8120},         {kHeartbeatError, 0x8130}, {kBusOffLeft, 0x8140},
      {kIdCollision, 0x8150},     {kPdoLength, 0x8210},      {kPdoTooLong, 0x8220},
      {kMpdoDestination, 0x8230}, {kSyncLength, 0x8240},     {kRpdoTimeout, 0x8250}};
  for (const auto& [code, expected] : table) {
    EXPECT_EQ(code, expected);
  }
}

// 1001h, CiA 301, 7.5.2.2.
TEST(EmcyMessage, BitsOfTheErrorRegister) {
  EXPECT_EQ(kGeneric, 1 << 0);
  EXPECT_EQ(kCurrent, 1 << 1);
  EXPECT_EQ(kVoltage, 1 << 2);
  EXPECT_EQ(kTemperature, 1 << 3);
  EXPECT_EQ(kCommunication, 1 << 4);
  EXPECT_EQ(kProfile, 1 << 5);
  EXPECT_EQ(kManufacturer, 1 << 7);
}

TEST(EmcyMessage, OtherLengthsAreMalformed) {
  for (std::uint8_t length = 0; length < 8; ++length) {
    can::Frame frame = encode(kMessage, can::CobId{0x85});
    frame.length = length;
    EXPECT_FALSE(decode(frame)) << int{length};
  }
}

TEST(EmcyMessage, Event) {
  const auto event = to_event<event::Emcy>(kMessage);
  EXPECT_EQ(event.code, 0x8210U);
  EXPECT_EQ(event.error_register, 0x11U);
  EXPECT_EQ(event.manufacturer.size(), 5U);
  EXPECT_EQ(event.manufacturer[4], std::byte{5});
}

TEST(EmcyMessage, OfCanopenFdHasTwentyBytes) {
  Message message = kMessage;
  message.fd = {
      .any = true,
      .logical_device = 3,
      .status = kStatusActive | 0x40,
      .profile = 402,
      .time_of_day = {std::byte{0x10}, std::byte{0x27}, {}, {}, std::byte{0x3A}, std::byte{0x3D}}};
  const can::Frame frame = encode(message, can::CobId{0x85});
  EXPECT_EQ(frame.length, 20);
  EXPECT_TRUE(frame.fd());
  EXPECT_NE(frame.flags & can::Frame::kBitRateSwitch, 0);
  EXPECT_EQ(frame.data[3], std::byte{3});
  EXPECT_EQ(frame.data[4], std::byte{0x92});
  EXPECT_EQ(frame.data[5], std::byte{0x01});
  EXPECT_EQ(frame.data[6], std::byte{0x41});
  EXPECT_EQ(frame.data[7], std::byte{0});
  EXPECT_EQ(frame.data[8], std::byte{0x10});
  EXPECT_EQ(frame.data[13], std::byte{0x3D});
  EXPECT_TRUE(std::equal(message.info.begin(), message.info.end(), frame.data.begin() + 14));
  EXPECT_EQ(frame.data[19], std::byte{0});
  EXPECT_EQ(decode_fd(frame), message);
  EXPECT_FALSE(decode(frame));
  EXPECT_EQ(fd_text(message.fd),
            ", logical device 3, profile 402, active, class 4, at 2026-11-30 00:00:10.000");
  EXPECT_EQ(fd_text({.any = true}), ", logical device all, profile 0, not active");
}

TEST(EmcyMessage, OfCanopenFdHasNoOtherLengthOrFormat) {
  can::Frame frame;
  frame.id = 0x85;
  frame.flags = can::Frame::kFd;
  for (const int length : {0, 8, 16, 24, 64}) {
    frame.length = static_cast<std::uint8_t>(length);
    EXPECT_FALSE(decode_fd(frame)) << length;
  }
  frame.length = 20;
  EXPECT_TRUE(decode_fd(frame));
  frame.flags = 0;
  EXPECT_FALSE(decode_fd(frame));
}

}  // namespace
}  // namespace linegate::emcy
