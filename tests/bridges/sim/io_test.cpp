// SPDX-License-Identifier: Apache-2.0
// Digital and analogue I/O (CiA 401) and the encoder (CiA 406).
#include <algorithm>
#include <bit>
#include <cmath>
#include <set>

#include <gtest/gtest.h>

#include "tests/bridges/sim/bench.h"

namespace linegate::sim {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

TEST(DigitalIo, InputsChangeAndAreSentOnChange) {
  DeviceBench bench("digital-io");
  bench.start_node();
  bench.run(milliseconds(100));
  bench.sent.clear();
  bench.run(seconds(2));
  const auto pdos = bench.take(0x185);
  std::set<std::byte> counts;
  for (const can::Frame& pdo : pdos) {
    ASSERT_EQ(pdo.length, 4);
    counts.insert(pdo.data[0]);
  }
  EXPECT_EQ(counts.size(), 8U);  // four counts per second
}

TEST(DigitalIo, BitsAreThoseOfInputByteOne) {
  DeviceBench bench("digital-io");
  for (int i = 0; i < 20; ++i) {
    bench.run(milliseconds(250));
    const std::uint64_t byte = bench.value({0x6000, 1});
    for (std::uint8_t bit = 0; bit < 8; ++bit) {
      EXPECT_EQ(bench.value({0x6020, static_cast<std::uint8_t>(bit + 1)}), (byte >> bit) & 1U);
    }
  }
}

TEST(DigitalIo, OutputByteOneIsMirroredFromRpdoAndSdo) {
  DeviceBench bench("digital-io");
  bench.write({0x6200, 1}, 0x3C);
  EXPECT_EQ(bench.value({0x6000, 2}), 0x3CU);
  bench.start_node();
  bench.run(milliseconds(50));
  bench.sent.clear();
  bench.give(can::make_frame(0x205, {0xA5, 0x01}));
  EXPECT_EQ(bench.value({0x6200, 1}), 0xA5U);
  EXPECT_EQ(bench.value({0x6000, 2}), 0xA5U);
  bench.run(milliseconds(20));
  const auto pdos = bench.take(0x185);
  ASSERT_FALSE(pdos.empty());
  EXPECT_EQ(pdos.back().data[1], std::byte{0xA5});
}

TEST(DigitalIo, OutputsTakeTheirErrorValueWhenOperationEnds) {
  DeviceBench bench("digital-io");
  bench.write({0x6206, 1}, 0x0F);
  bench.write({0x6207, 1}, 0x05);
  bench.start_node();
  bench.give(can::make_frame(0x205, {0xFA, 0xFF}));
  bench.nmt(nmt::Command::enter_pre_operational);
  EXPECT_EQ(bench.value({0x6200, 1}), 0xF5U);
  EXPECT_EQ(bench.value({0x6200, 2}), 0x00U);
  EXPECT_EQ(bench.value({0x6000, 2}), 0xF5U);
}

TEST(AnalogIo, InputsMoveWithinTheirRange) {
  DeviceBench bench("analog-io");
  bench.start_node();
  bench.sent.clear();
  bench.run(seconds(10));
  int lowest = 40000;
  int highest = -40000;
  const auto pdos = bench.take(0x285);
  EXPECT_GT(pdos.size(), 100U);
  for (const can::Frame& pdo : pdos) {
    const auto sine = static_cast<std::int16_t>(load_le<std::uint16_t>(pdo.data.data()));
    lowest = std::min<int>(lowest, sine);
    highest = std::max<int>(highest, sine);
  }
  EXPECT_LT(lowest, -32000);
  EXPECT_GT(highest, 32000);
}

TEST(AnalogIo, FloatShowsTheSameInVolts) {
  DeviceBench bench("analog-io");
  bench.run(milliseconds(1234));
  for (const std::uint8_t sub : std::initializer_list<std::uint8_t>{1, 2}) {
    const auto raw = static_cast<std::int16_t>(bench.value({0x6401, sub}));
    const auto volts = std::bit_cast<float>(static_cast<std::uint32_t>(bench.value({0x6403, sub})));
    EXPECT_NEAR(volts, raw / 32767.0 * 10.0, 0.001);
  }
}

TEST(AnalogIo, InputThreeFollowsOutputOne) {
  DeviceBench bench("analog-io");
  bench.start_node();
  bench.give(can::make_frame(0x305, {0xE8, 0x03, 0x00, 0x00}));  // 1000
  bench.run(milliseconds(60));
  const std::uint64_t soon = bench.value({0x6401, 3});
  EXPECT_GT(soon, 0U);
  EXPECT_LT(soon, 1000U);
  bench.run(seconds(3));
  EXPECT_EQ(bench.value({0x6401, 3}), 1000U);
}

TEST(AnalogIo, WithoutInterruptEnableOnlyTheEventTimerSends) {
  DeviceBench bench("analog-io");
  bench.write({0x6423, 0}, 0);
  bench.start_node();
  bench.run(seconds(1));
  bench.sent.clear();
  bench.run(seconds(5));
  EXPECT_EQ(bench.take(0x285).size(), 10U);
}

TEST(AnalogIo, OutputsTakeTheirErrorValueWhenOperationEnds) {
  DeviceBench bench("analog-io");
  bench.write({0x6444, 1}, 0x1234'0000);
  bench.write({0x6443, 2}, 0);
  bench.start_node();
  bench.give(can::make_frame(0x305, {0xE8, 0x03, 0xE8, 0x03}));
  bench.nmt(nmt::Command::stop);
  EXPECT_EQ(bench.value({0x6411, 1}), 0x1234U);
  EXPECT_EQ(bench.value({0x6411, 2}), 1000U);
}

TEST(FdIo, SixtyFourBytesOfOutputsAreMirroredInOnePdo) {
  DeviceBench bench("fd-io");
  bench.start_node();
  bench.run(seconds(1));
  bench.sent.clear();
  can::Frame rpdo;
  rpdo.id = 0x205;
  rpdo.flags = can::Frame::kFd;
  rpdo.length = 64;
  for (std::size_t i = 0; i < 64; ++i) {
    rpdo.data[i] = static_cast<std::byte>(i + 1);
  }
  bench.give(rpdo);
  bench.run(milliseconds(50));  // its inhibit time
  const auto pdos = bench.take(0x185);
  ASSERT_FALSE(pdos.empty());
  EXPECT_EQ(pdos.back().length, 64);
  EXPECT_TRUE(std::ranges::equal(pdos.back().bytes().subspan(1), rpdo.bytes().subspan(1)));
}

TEST(Encoder, PositionIsSentByTheEventTimerAndMovesAsTheSpeedSays) {
  DeviceBench bench("encoder");
  bench.start_node();
  bench.run(milliseconds(500));
  bench.sent.clear();
  bench.run(seconds(4));
  const auto pdos = bench.take(0x185);
  ASSERT_EQ(pdos.size(), 40U);
  for (std::size_t i = 1; i < pdos.size(); ++i) {
    ASSERT_EQ(pdos[i].length, 6);
    const auto moved = static_cast<std::int32_t>(load_le<std::uint32_t>(pdos[i].data.data()) -
                                                 load_le<std::uint32_t>(pdos[i - 1].data.data()));
    const auto before = static_cast<std::int16_t>(load_le<std::uint16_t>(&pdos[i - 1].data[4]));
    const auto after = static_cast<std::int16_t>(load_le<std::uint16_t>(&pdos[i].data[4]));
    EXPECT_NEAR(moved, (before + after) / 2.0 * 0.1, 3.0);
  }
}

TEST(Encoder, SynchronousPdoComesWithEachSync) {
  DeviceBench bench("encoder");
  bench.start_node();
  bench.sent.clear();
  for (int i = 0; i < 5; ++i) {
    bench.sync();
    bench.run(milliseconds(10));
  }
  const auto pdos = bench.take(0x285);
  ASSERT_EQ(pdos.size(), 5U);
  EXPECT_NE(load_le<std::uint32_t>(pdos[0].data.data()),
            load_le<std::uint32_t>(pdos[4].data.data()));
}

TEST(Encoder, PresetSetsThePosition) {
  DeviceBench bench("encoder");
  bench.write({0x6003, 0}, 1000);
  EXPECT_EQ(bench.value({0x6004, 0}), 1000U);
  bench.run(seconds(1));
  const std::uint64_t later = bench.value({0x6004, 0});
  EXPECT_GT(later, 1000U);
  EXPECT_LT(later, 6000U);
  bench.write({0x6003, 0}, 0x00FF'FFFF);
  bench.run(seconds(1));
  EXPECT_LT(bench.value({0x6004, 0}), 6000U);  // wrapped at 6002h
}

}  // namespace
}  // namespace linegate::sim
