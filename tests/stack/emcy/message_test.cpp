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

}  // namespace
}  // namespace linegate::emcy
