// SPDX-License-Identifier: Apache-2.0
#include "stack/lss/message.h"

#include <gtest/gtest.h>

#include "tests/stack/lss/slaves.h"

namespace linegate::lss {
namespace {

using testing::Bytes;
using testing::bytes_of;
using testing::frame_of;

TEST(LssMessage, IsEightBytesLeastSignificantFirst) {
  const Message message{.command = Command::fastscan, .number = 0x04030201, .rest = {5, 6, 7}};
  const can::Frame frame = encode(kMasterId, message);
  EXPECT_EQ(frame.id, 0x7E5U);
  EXPECT_EQ(bytes_of(frame), (Bytes{0x51, 1, 2, 3, 4, 5, 6, 7}));
  EXPECT_EQ(decode(frame), message);
}

TEST(LssMessage, OfAnyOtherFormIsNone) {
  EXPECT_FALSE(decode(frame_of(kMasterId, Bytes(7))));
  can::Frame frame = frame_of(kMasterId, Bytes(8));
  EXPECT_TRUE(decode(frame));
  for (const auto flag : {can::Frame::kRemote, can::Frame::kExtended, can::Frame::kFd}) {
    frame.flags = flag;
    EXPECT_FALSE(decode(frame));
  }
}

TEST(LssMessage, BitTimingsAreThoseOfTableZero) {
  const std::uint32_t kbit[] = {1000, 800, 500, 250, 125, 0, 50, 20, 10, 0, 0};
  for (std::uint8_t i = 0; i < std::size(kbit); ++i) {
    EXPECT_EQ(bit_rate(i).value_or(0), kbit[i] * 1000) << int{i};
    if (kbit[i] != 0) {
      EXPECT_EQ(bit_timing_index(kbit[i] * 1000), i);
    }
  }
  EXPECT_FALSE(bit_timing_index(0));
  EXPECT_FALSE(bit_timing_index(100'000));
}

}  // namespace
}  // namespace linegate::lss
