// SPDX-License-Identifier: Apache-2.0
#include "bridges/can/frame_codec.h"

#include <gtest/gtest.h>

#include "bridges/can/sendable.h"

namespace linegate::can_bridge {
namespace {

using can::Frame;

Frame sample(std::uint32_t id, std::uint8_t flags, std::uint8_t length) {
  Frame frame;
  frame.id = id;
  frame.flags = flags;
  frame.length = length;
  for (std::size_t i = 0; i < length; ++i) {
    frame.data[i] = static_cast<std::byte>(i + 1);
  }
  return frame;
}

TEST(FrameCodec, WhatIsEncodedIsDecodedAgain) {
  const Frame frames[] = {
      sample(0x181, 0, 8),
      sample(0x000, 0, 2),
      sample(0x1FFF'FFFF, Frame::kExtended, 3),
      sample(0x701, Frame::kRemote, 1),
      sample(0x181, Frame::kFd, 64),
      sample(0x181, Frame::kFd | Frame::kBitRateSwitch | Frame::kErrorStateIndicator, 12),
  };
  for (const Frame& frame : frames) {
    canfd_frame raw{};
    const std::size_t bytes = encode(frame, raw);
    EXPECT_EQ(bytes, frame.fd() ? CANFD_MTU : CAN_MTU);
    Frame back;
    ASSERT_TRUE(decode(raw, bytes, back));
    EXPECT_TRUE(same_content(frame, back));
  }
}

TEST(FrameCodec, ImpossibleDatagramsAreRefused) {
  canfd_frame raw{};
  Frame out;
  raw.len = 9;
  EXPECT_FALSE(decode(raw, CAN_MTU, out));
  EXPECT_TRUE(decode(raw, CANFD_MTU, out));
  raw.len = 65;
  EXPECT_FALSE(decode(raw, CANFD_MTU, out));
  raw.len = 1;
  for (const std::size_t bytes : {0U, 1U, 15U, 17U, 71U}) {
    EXPECT_FALSE(decode(raw, bytes, out)) << bytes;
  }
}

TEST(Sendable, FollowsTheFormats) {
  EXPECT_TRUE(sendable(sample(0x7FF, 0, 8), false));
  EXPECT_FALSE(sendable(sample(0x800, 0, 8), false));
  EXPECT_FALSE(sendable(sample(0x7FF, 0, 9), true));
  EXPECT_TRUE(sendable(sample(0x800, Frame::kExtended, 8), false));
  EXPECT_FALSE(sendable(sample(0x2000'0000, Frame::kExtended, 8), false));
  EXPECT_FALSE(sendable(sample(0x181, Frame::kFd, 8), false));
  EXPECT_TRUE(sendable(sample(0x181, Frame::kFd, 48), true));
  EXPECT_FALSE(sendable(sample(0x181, Frame::kFd, 47), true));
  EXPECT_FALSE(sendable(sample(0x181, Frame::kFd | Frame::kRemote, 0), true));
}

}  // namespace
}  // namespace linegate::can_bridge
