// SPDX-License-Identifier: Apache-2.0
// The simulated drive as a whole (CiA 402).
#include <gtest/gtest.h>

#include "bridges/sim/drive_motion.h"

#include "tests/bridges/sim/bench.h"

namespace linegate::sim {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

constexpr od::Address kErrorCode{0x603F, 0};
constexpr od::Address kStatusword{0x6041, 0};
constexpr od::Address kPosition{0x6064, 0};
constexpr od::Address kVelocity{0x606C, 0};

class DriveTest : public testing::Test {
 protected:
  void SetUp() override { bench.start_node(); }

  void control(std::uint16_t word, std::int8_t mode = 1) {
    bench.give(can::make_frame(
        0x205, {static_cast<std::uint8_t>(word), static_cast<std::uint8_t>(word >> 8U),
                static_cast<std::uint8_t>(mode)}));
  }
  void targets(std::int32_t position, std::int32_t velocity) {
    can::Frame frame = can::make_frame(0x305, {0, 0, 0, 0, 0, 0, 0, 0});
    store_le(&frame.data[0], static_cast<std::uint32_t>(position));
    store_le(&frame.data[4], static_cast<std::uint32_t>(velocity));
    bench.give(frame);
    bench.sync();
  }
  void enable(std::int8_t mode = 1) {
    control(0x06, mode);
    control(0x07, mode);
    control(0x0F, mode);
    ASSERT_EQ(bench.value(kStatusword) & 0x6FU, 0x27U);
  }
  bool target_reached() { return (bench.value(kStatusword) & 0x0400U) != 0; }

  DeviceBench bench{"drive"};
};

TEST_F(DriveTest, StatuswordIsSentWhenTheStateChanges) {
  EXPECT_EQ(bench.value(kStatusword), 0x0240U);
  bench.sent.clear();
  control(0x06);
  auto pdos = bench.take(0x185);
  ASSERT_EQ(pdos.size(), 1U);
  EXPECT_EQ(load_le<std::uint16_t>(pdos[0].data.data()) & 0x6FU, 0x21U);
  EXPECT_EQ(pdos[0].data[2], std::byte{1});
  control(0x07);
  pdos = bench.take(0x185);
  ASSERT_EQ(pdos.size(), 1U);
  EXPECT_EQ(load_le<std::uint16_t>(pdos[0].data.data()) & 0x6FU, 0x23U);
}

TEST_F(DriveTest, ControlwordWorksOverSdoToo) {
  bench.write({0x6040, 0}, 0x06);
  EXPECT_EQ(bench.value(kStatusword) & 0x6FU, 0x21U);
}

TEST_F(DriveTest, ProfilePositionNeedsANewSetPoint) {
  enable();
  targets(5000, 0);
  bench.run(seconds(1));
  EXPECT_EQ(bench.value32(kPosition), 0);
  control(0x1F);
  EXPECT_NE(bench.value(kStatusword) & 0x1000U, 0U);
  EXPECT_FALSE(target_reached());
  bench.run(milliseconds(100));
  EXPECT_GT(bench.value32(kPosition), 0);
  EXPECT_LT(bench.value32(kPosition), 5000);
  bench.run(seconds(2));
  EXPECT_EQ(bench.value32(kPosition), 5000);
  EXPECT_EQ(bench.value32(kVelocity), 0);
  EXPECT_TRUE(target_reached());
  control(0x0F);
  EXPECT_EQ(bench.value(kStatusword) & 0x1000U, 0U);
  targets(-1000, 0);
  control(0x5F);  // relative positioning
  bench.run(seconds(2));
  EXPECT_EQ(bench.value32(kPosition), 4000);
}

TEST_F(DriveTest, ProfileVelocityIsReachedAndHalted) {
  enable(3);
  targets(0, -8000);
  bench.run(seconds(1));
  EXPECT_EQ(bench.value32(kVelocity), -8000);
  EXPECT_LT(bench.value32(kPosition), -5000);
  EXPECT_TRUE(target_reached());
  control(0x010F, 3);
  bench.run(seconds(1));
  EXPECT_EQ(bench.value32(kVelocity), 0);
}

TEST_F(DriveTest, CyclicPositionFollowsWithEverySync) {
  enable(8);
  for (std::int32_t i = 1; i <= 20; ++i) {
    targets(i * 50, 0);
    bench.run(milliseconds(10));
  }
  bench.run(milliseconds(500));
  EXPECT_EQ(bench.value32(kPosition), 1000);
  bench.sent.clear();
  bench.sync();
  const auto pdos = bench.take(0x285);
  ASSERT_EQ(pdos.size(), 1U);
  EXPECT_EQ(load_le<std::uint32_t>(pdos[0].data.data()), 1000U);
}

TEST_F(DriveTest, TargetsAreTakenOverAtSyncOnly) {
  enable(3);
  can::Frame frame = can::make_frame(0x305, {0, 0, 0, 0, 0x10, 0x27, 0, 0});
  bench.give(frame);
  bench.run(milliseconds(200));
  EXPECT_EQ(bench.value32(kVelocity), 0);
  bench.sync();
  bench.run(milliseconds(200));
  EXPECT_GT(bench.value32(kVelocity), 0);
}

TEST_F(DriveTest, QuickStopBrakesAndEndsInSwitchOnDisabled) {
  enable(3);
  targets(0, 10000);
  bench.run(seconds(1));
  control(0x02, 3);
  EXPECT_EQ(bench.value(kStatusword) & 0x6FU, 0x07U);
  bench.run(milliseconds(50));
  EXPECT_GT(bench.value32(kVelocity), 0);
  bench.run(seconds(1));
  EXPECT_EQ(bench.value32(kVelocity), 0);
  EXPECT_EQ(bench.value(kStatusword) & 0x4FU, 0x40U);
}

TEST_F(DriveTest, FaultIsAnEmcyAndNeedsAReset) {
  enable(3);
  targets(0, 10000);
  bench.run(seconds(1));
  bench.sent.clear();
  bench.write({0x2000, 0}, 0x2310);
  auto emcy = bench.take(0x085);
  ASSERT_EQ(emcy.size(), 1U);
  EXPECT_EQ(load_le<std::uint16_t>(emcy[0].data.data()), 0x2310U);
  EXPECT_EQ(emcy[0].data[2], std::byte{0x03});
  EXPECT_EQ(bench.value(kErrorCode), 0x2310U);
  EXPECT_EQ(bench.value(kStatusword) & 0x4FU, 0x08U);
  EXPECT_EQ(bench.value32(kVelocity), 0);
  EXPECT_EQ(bench.value({0x2000, 0}), 0U);
  control(0x06, 3);
  EXPECT_EQ(bench.value(kStatusword) & 0x4FU, 0x08U);
  control(0x80, 3);
  EXPECT_EQ(bench.value(kStatusword) & 0x4FU, 0x40U);
  EXPECT_EQ(bench.value(kErrorCode), 0U);
  emcy = bench.take(0x085);
  ASSERT_EQ(emcy.size(), 1U);
  EXPECT_EQ(load_le<std::uint16_t>(emcy[0].data.data()), 0U);
}

TEST_F(DriveTest, LeavingOperationalDoesWhatTheOptionSays) {
  enable();
  bench.nmt(nmt::Command::stop);
  EXPECT_EQ(bench.value(kStatusword) & 0x4FU, 0x40U);  // 6007h = 2: disable voltage
  bench.nmt(nmt::Command::enter_pre_operational);
  bench.write({0x6007, 0}, 1);
  bench.start_node();
  enable();
  bench.nmt(nmt::Command::enter_pre_operational);
  EXPECT_EQ(bench.value(kStatusword) & 0x4FU, 0x08U);
  EXPECT_EQ(bench.value(kErrorCode), 0x8130U);
}

TEST_F(DriveTest, UnsupportedModeIsNotShown) {
  control(0x06, 6);
  EXPECT_EQ(bench.value({0x6061, 0}), 1U);
  control(0x06, 9);
  EXPECT_EQ(bench.value({0x6061, 0}), 9U);
}

TEST(DriveMotion, AlwaysComesToRestAtTheTargetWithoutPassingIt) {
  for (const double target : {1.0, 7.0, 100.0, 3333.0, 250000.0, -4096.0}) {
    DriveMotion motion;
    const DriveMotion::Limits limits{20000, 50000};
    int steps = 0;
    while ((motion.position() != target || motion.velocity() != 0) && steps < 5000) {
      motion.step_to_position(target, limits);
      ++steps;
      EXPECT_LE(std::abs(motion.velocity()), limits.velocity);
      EXPECT_LE(std::abs(motion.position()), std::abs(target) + 1.0);
    }
    EXPECT_LT(steps, 5000) << target;
  }
}

}  // namespace
}  // namespace linegate::sim
