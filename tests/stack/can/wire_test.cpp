// SPDX-License-Identifier: Apache-2.0
#include "stack/can/wire.h"

#include <algorithm>
#include <random>
#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace linegate::can {
namespace {

// CRC-15/CAN (polynomial 4599h, start 0) by long division over a string of '0' and '1'.
std::uint16_t divide(const std::string& bits) {
  std::string rest = bits + std::string(15, '0');
  const std::string divisor = "1100010110011001";  // x^15 + 4599h
  for (std::size_t i = 0; i < bits.size(); ++i) {
    if (rest[i] == '1') {
      for (std::size_t k = 0; k < divisor.size(); ++k) {
        rest[i + k] = rest[i + k] == divisor[k] ? '0' : '1';
      }
    }
  }
  return static_cast<std::uint16_t>(std::stoul(rest.substr(bits.size()), nullptr, 2));
}

std::string binary(std::uint32_t value, unsigned count) {
  std::string text;
  while (count-- > 0) {
    text += ((value >> count) & 1U) != 0 ? '1' : '0';
  }
  return text;
}

std::string unstuffed_standard(const Frame& frame) {
  std::string bits = "0" + binary(frame.id, 11) + (frame.remote() ? "1" : "0") + "00";
  bits += binary(frame.length, 4);
  for (const std::byte b : frame.bytes()) {
    bits += binary(std::to_integer<std::uint32_t>(b), 8);
  }
  return bits;
}

unsigned count_stuff_bits(const std::string& bits) {
  unsigned stuffed = 0;
  std::string sent;
  for (const char bit : bits) {
    sent += bit;
    if (sent.ends_with("00000") || sent.ends_with("11111")) {
      sent += bit == '0' ? '1' : '0';
      ++stuffed;
    }
  }
  return stuffed;
}

unsigned total(const Frame& frame) {
  return wire_bits(frame).nominal + wire_bits(frame).data + kIntermissionBits;
}

Frame random_frame(std::mt19937& random, std::uint8_t length) {
  Frame frame;
  frame.id = random() & 0x7FFU;
  frame.length = length;
  std::ranges::generate(frame.data, [&] { return static_cast<std::byte>(random()); });
  return frame;
}

TEST(Wire, ReferenceDivisionGivesTheCatalogueCheckValue) {
  std::string bits;
  for (const char c : std::string("123456789")) {
    bits += binary(static_cast<std::uint32_t>(c), 8);
  }
  EXPECT_EQ(divide(bits), 0x059E);
}

TEST(Wire, CrcAndStuffBitsAreThoseOfTheBitString) {
  std::mt19937 random(7);
  for (int i = 0; i < 2000; ++i) {
    Frame frame = random_frame(random, static_cast<std::uint8_t>(i % 9));
    if (i % 3 == 0) {
      frame.data.fill(std::byte{0});
    }
    const std::string bits = unstuffed_standard(frame);
    EXPECT_EQ(crc15(frame), divide(bits));
    const std::string stuffed_part = bits + binary(divide(bits), 15);
    EXPECT_EQ(wire_bits(frame).nominal, stuffed_part.size() + count_stuff_bits(stuffed_part) + 10);
    EXPECT_EQ(wire_bits(frame).data, 0U);
  }
}

TEST(Wire, EightByteStandardFramesTake111To135Bits) {
  std::mt19937 random(1);
  unsigned least = 1000;
  unsigned most = 0;
  double sum = 0;
  constexpr int kFrames = 20000;
  for (int i = 0; i < kFrames; ++i) {
    const unsigned bits = total(random_frame(random, 8));
    least = std::min(least, bits);
    most = std::max(most, bits);
    sum += bits;
  }
  EXPECT_GE(least, 111U);
  EXPECT_LE(most, 135U);
  EXPECT_NEAR(sum / kFrames, 1e6 / 8757, 0.3);  // random data at 1 Mbit/s: 8757 frames/s
}

TEST(Wire, AlternatingBitsNeedFewStuffBitsAndZerosMany) {
  Frame quiet = make_frame(0x555, {0x55, 0x55, 0x55, 0x55, 0x55, 0x55, 0x55, 0x55});
  EXPECT_LE(total(quiet), 113U);
  Frame zeros = make_frame(0x000, {0, 0, 0, 0, 0, 0, 0, 0});
  EXPECT_GE(total(zeros), 111U + 15U);
}

TEST(Wire, EmptyFrameOfZerosHasKnownLength) {
  // 19 zero bits and a CRC of 15 zero bits: 34 bits, a stuff bit after every five of them.
  EXPECT_EQ(crc15(make_frame(0)), 0);
  EXPECT_EQ(wire_bits(make_frame(0)).nominal, 34U + 34U / 5U + 10U);
}

TEST(Wire, ExtendedIdentifierAddsTwentyBits) {
  Frame frame;
  frame.flags = Frame::kExtended;
  frame.id = 0x0AAA'AAAA;
  frame.length = 8;
  frame.data.fill(std::byte{0x55});
  EXPECT_GE(total(frame), 131U);
  EXPECT_LE(total(frame), 160U);
}

TEST(Wire, RemoteFrameCarriesNoData) {
  Frame frame = make_frame(0x701);
  frame.flags = Frame::kRemote;
  frame.length = 8;
  EXPECT_LE(wire_bits(frame).nominal, wire_bits(make_frame(0x701)).nominal + 4);
}

TEST(Wire, FdFrameOf64BytesIsWithinTheReferenceFigures) {
  std::mt19937 random(3);
  for (int i = 0; i < 2000; ++i) {
    Frame frame = random_frame(random, 64);
    frame.flags = Frame::kFd | Frame::kBitRateSwitch;
    const WireBits bits = wire_bits(frame);
    EXPECT_GE(bits.nominal + kIntermissionBits, 30U);
    EXPECT_LE(bits.nominal + kIntermissionBits, 34U);
    EXPECT_GE(bits.data, 549U);
    EXPECT_LE(bits.data, 678U);
  }
}

TEST(Wire, FdFrameWithoutSwitchIsSentAtTheNominalRate) {
  Frame frame = make_frame(0x181, {1, 2, 3});
  frame.flags = Frame::kFd;
  EXPECT_EQ(wire_bits(frame).data, 0U);
  EXPECT_EQ(wire_time(frame, 500'000, 1), bit_time(wire_bits(frame).nominal, 500'000));
}

TEST(Wire, TimeIsBitsByRate) {
  EXPECT_EQ(bit_time(111, 1'000'000), std::chrono::microseconds(111));
  EXPECT_EQ(bit_time(1, 500'000), std::chrono::microseconds(2));
  EXPECT_EQ(bit_time(1, 800'000), std::chrono::nanoseconds(1250));
  Frame frame = make_frame(0x181, {1, 2, 3, 4, 5, 6, 7, 8});
  frame.flags = Frame::kFd | Frame::kBitRateSwitch;
  const WireBits bits = wire_bits(frame);
  EXPECT_EQ(wire_time(frame, 1'000'000, 5'000'000),
            bit_time(bits.nominal, 1'000'000) + bit_time(bits.data, 5'000'000));
}

}  // namespace
}  // namespace linegate::can
