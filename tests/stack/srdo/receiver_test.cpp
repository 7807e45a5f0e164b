// SPDX-License-Identifier: Apache-2.0
// One SRDO, byte by byte and deadline by deadline.
#include "stack/srdo/receiver.h"

#include <chrono>
#include <cstddef>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

namespace linegate::srdo {
namespace {

using namespace std::chrono_literals;

Instant at(Duration time) {
  return Instant{} + 1s + time;
}

class ReceiverTest : public testing::Test {
 protected:
  bool normal(Duration time, std::initializer_list<std::uint8_t> data) {
    return receive(time, data, false);
  }
  bool inverted(Duration time, std::initializer_list<std::uint8_t> data) {
    return receive(time, data, true);
  }
  bool receive(Duration time, std::initializer_list<std::uint8_t> data, bool is_inverted) {
    can::Frame frame = can::make_frame(is_inverted ? 0x10AU : 0x109U, data);
    frame.time = at(time);
    return receiver_.receive(frame, is_inverted);
  }
  bool pair(Duration time) {
    return !normal(time, {0x12, 0x34}) && inverted(time + 1ms, {0xED, 0xCB});
  }

  Receiver receiver_{2, 20ms, 50ms};
};

TEST_F(ReceiverTest, APairIsComplete) {
  EXPECT_EQ(receiver_.fault(), Fault::not_received);
  EXPECT_EQ(receiver_.next_wake(), kNever);
  EXPECT_FALSE(normal(0ms, {0x12, 0x34}));
  EXPECT_EQ(receiver_.fault(), Fault::not_received);
  EXPECT_EQ(receiver_.next_wake(), at(20ms));
  EXPECT_TRUE(inverted(5ms, {0xED, 0xCB}));
  EXPECT_EQ(receiver_.fault(), Fault::none);
  EXPECT_EQ(receiver_.normal().data[0], std::byte{0x12});
  EXPECT_EQ(receiver_.normal().data[1], std::byte{0x34});
  EXPECT_EQ(receiver_.normal().time, at(5ms));
  EXPECT_EQ(receiver_.next_wake(), at(55ms));
}

// Each bit of each byte counts.
TEST(Receiver, EveryBitOfEveryByteIsChecked) {
  for (std::uint8_t length = 1; length <= 8; ++length) {
    for (unsigned bit = 0; bit < 8U * length; ++bit) {
      Receiver receiver(length, 20ms, 50ms);
      can::Frame first = can::make_frame(0x101, {0x00, 0xFF, 0x5A, 1, 2, 3, 4, 0x80});
      first.length = length;
      can::Frame second = first;
      for (std::byte& octet : second.data) {
        octet = ~octet;
      }
      EXPECT_FALSE(receiver.receive(first, false));
      EXPECT_TRUE(receiver.receive(second, true));
      second.data[bit / 8] ^= static_cast<std::byte>(1U << bit % 8);
      EXPECT_FALSE(receiver.receive(first, false));
      EXPECT_FALSE(receiver.receive(second, true)) << "length " << +length << ", bit " << bit;
      EXPECT_EQ(receiver.fault(), Fault::inverse);
    }
  }
}

TEST_F(ReceiverTest, BytesBeyondTheLengthDoNotCount) {
  can::Frame first = can::make_frame(0x109, {1, 2});
  can::Frame second = can::make_frame(0x10A, {0xFE, 0xFD});
  first.data[2] = second.data[2] = std::byte{7};
  EXPECT_FALSE(receiver_.receive(first, false));
  EXPECT_TRUE(receiver_.receive(second, true));
}

TEST_F(ReceiverTest, AWrongLengthIsUnsafe) {
  ASSERT_TRUE(pair(0ms));
  EXPECT_FALSE(normal(10ms, {0x12}));
  EXPECT_EQ(receiver_.fault(), Fault::length);
  EXPECT_FALSE(inverted(11ms, {0xED, 0xCB})) << "its normal frame was not used";
  EXPECT_EQ(receiver_.fault(), Fault::length);
  EXPECT_TRUE(pair(20ms));
  EXPECT_EQ(receiver_.fault(), Fault::none);
  EXPECT_FALSE(normal(30ms, {0x12, 0x34}));
  EXPECT_FALSE(inverted(31ms, {0xED, 0xCB, 0xFF}));
  EXPECT_EQ(receiver_.fault(), Fault::length);
  EXPECT_TRUE(pair(40ms));
}

TEST_F(ReceiverTest, CanFdIsAWrongLengthAndARemoteFrameIsNone) {
  ASSERT_TRUE(pair(0ms));
  can::Frame frame = can::make_frame(0x109, {1, 2});
  frame.time = at(10ms);
  frame.flags = can::Frame::kRemote;
  EXPECT_FALSE(receiver_.receive(frame, false));
  EXPECT_EQ(receiver_.fault(), Fault::none);
  frame.flags = can::Frame::kFd;
  EXPECT_FALSE(receiver_.receive(frame, false));
  EXPECT_EQ(receiver_.fault(), Fault::length);
}

TEST_F(ReceiverTest, AnInvertedFrameFirstIsUnsafe) {
  EXPECT_TRUE(pair(5ms));
  EXPECT_FALSE(inverted(10ms, {0xED, 0xCB}));
  EXPECT_EQ(receiver_.fault(), Fault::order);
}

// The reception began within a pair.
TEST_F(ReceiverTest, TheFirstFrameOfAllMayBeAnInvertedOne) {
  EXPECT_FALSE(inverted(0ms, {0xED, 0xCB}));
  EXPECT_EQ(receiver_.fault(), Fault::not_received);
  EXPECT_FALSE(inverted(5ms, {0xED, 0xCB}));
  EXPECT_EQ(receiver_.fault(), Fault::order);
}

TEST_F(ReceiverTest, AFrameFromBeforeIsForgotten) {
  ASSERT_TRUE(pair(0ms));
  EXPECT_FALSE(normal(10ms, {1, 2}));
  receiver_.forget();
  EXPECT_EQ(receiver_.fault(), Fault::not_received);
  EXPECT_EQ(receiver_.next_wake(), kNever);
  EXPECT_FALSE(inverted(11ms, {0xFE, 0xFD}));
  EXPECT_EQ(receiver_.fault(), Fault::not_received);
  EXPECT_TRUE(pair(20ms));
}

TEST_F(ReceiverTest, TwoNormalFramesAreUnsafeAndTheSecondBeginsAPair) {
  ASSERT_TRUE(pair(0ms));
  EXPECT_FALSE(normal(10ms, {1, 2}));
  EXPECT_FALSE(normal(11ms, {3, 4}));
  EXPECT_EQ(receiver_.fault(), Fault::order);
  EXPECT_TRUE(inverted(12ms, {0xFC, 0xFB}));
  EXPECT_EQ(receiver_.fault(), Fault::none);
  EXPECT_EQ(receiver_.normal().data[0], std::byte{3});
}

TEST_F(ReceiverTest, TheInvertedFrameIsInTimeAtTheEndOfTheSrvt) {
  EXPECT_FALSE(normal(0ms, {1, 2}));
  EXPECT_TRUE(inverted(20ms, {0xFE, 0xFD}));
  EXPECT_FALSE(normal(30ms, {1, 2}));
  EXPECT_FALSE(inverted(50ms + 1ns, {0xFE, 0xFD}));
  EXPECT_EQ(receiver_.fault(), Fault::validation_time);
}

TEST_F(ReceiverTest, TheSrvtEndsWithoutAFrame) {
  ASSERT_TRUE(pair(0ms));
  EXPECT_FALSE(normal(10ms, {1, 2}));
  receiver_.advance(at(30ms) - 1ns);
  EXPECT_EQ(receiver_.fault(), Fault::none);
  receiver_.advance(at(30ms));
  EXPECT_EQ(receiver_.fault(), Fault::validation_time);
  EXPECT_EQ(receiver_.next_wake(), kNever);
  EXPECT_FALSE(inverted(31ms, {0xFE, 0xFD})) << "it is late, and no fault of its own";
  EXPECT_EQ(receiver_.fault(), Fault::validation_time);
  EXPECT_TRUE(pair(40ms));
}

TEST_F(ReceiverTest, TheSctRunsFromPairToPair) {
  ASSERT_TRUE(pair(0ms));  // complete at 1 ms
  EXPECT_FALSE(normal(50ms, {1, 2}));
  EXPECT_TRUE(inverted(51ms, {0xFE, 0xFD})) << "in time at the end of the SCT";
  EXPECT_EQ(receiver_.fault(), Fault::none);
  receiver_.advance(at(101ms) - 1ns);
  EXPECT_EQ(receiver_.fault(), Fault::none);
  receiver_.advance(at(101ms));
  EXPECT_EQ(receiver_.fault(), Fault::cycle_time);
  EXPECT_EQ(receiver_.next_wake(), kNever);
  EXPECT_TRUE(pair(200ms));
  EXPECT_EQ(receiver_.fault(), Fault::none);
}

// A thread that was late passes frames and then the time.
TEST_F(ReceiverTest, ALateCallMissesNoDeadline) {
  ASSERT_TRUE(pair(0ms));
  EXPECT_FALSE(normal(45ms, {1, 2}));
  EXPECT_FALSE(normal(100ms, {1, 2})) << "SRVT and SCT ended before";
  EXPECT_EQ(receiver_.fault(), Fault::cycle_time) << "at 51 ms, before the SRVT";
}

TEST_F(ReceiverTest, TheFirstFaultIsKeptUntilAValidPair) {
  ASSERT_TRUE(pair(0ms));
  EXPECT_FALSE(normal(10ms, {1, 2}));
  EXPECT_FALSE(inverted(11ms, {1, 2}));
  EXPECT_EQ(receiver_.fault(), Fault::inverse);
  EXPECT_FALSE(inverted(12ms, {1, 2}));
  EXPECT_FALSE(normal(13ms, {1}));
  EXPECT_EQ(receiver_.fault(), Fault::inverse);
}

}  // namespace
}  // namespace linegate::srdo
