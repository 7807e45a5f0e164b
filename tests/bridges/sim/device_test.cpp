// SPDX-License-Identifier: Apache-2.0
#include "bridges/sim/device.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/bridges/sim/bench.h"

namespace linegate::sim {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;
using testing::HasSubstr;

class AnyDevice : public testing::TestWithParam<std::string_view> {};

TEST_P(AnyDevice, BootsAndWaitsInPreOperational) {
  DeviceBench bench{std::string(GetParam())};
  const auto boot_up = bench.take(0x705);
  ASSERT_EQ(boot_up.size(), 1U);
  EXPECT_EQ(boot_up[0].data[0], std::byte{0});
  EXPECT_EQ(bench.device->node().state(), nmt::State::pre_operational);
  bench.run(seconds(5));
  EXPECT_TRUE(bench.sent.empty());
}

TEST_P(AnyDevice, SendsProcessDataWhenOperational) {
  DeviceBench bench{std::string(GetParam())};
  bench.start_node();
  bench.sync();
  bench.run(seconds(2));
  std::size_t pdos = 0;
  for (const can::Frame& frame : bench.sent) {
    pdos += frame.id >= 0x180 && frame.id < 0x580 ? 1U : 0U;
    EXPECT_EQ(frame.id & 0x7FU, DeviceBench::kNode);
  }
  EXPECT_GT(pdos, 0U);
}

TEST_P(AnyDevice, SameSeedSameFrames) {
  DeviceBench one{std::string(GetParam()), 3};
  DeviceBench two{std::string(GetParam()), 3};
  for (DeviceBench* bench : {&one, &two}) {
    bench->start_node();
    for (int i = 0; i < 50; ++i) {
      bench->sync();
      bench->run(milliseconds(20));
    }
  }
  ASSERT_EQ(one.sent.size(), two.sent.size());
  for (std::size_t i = 0; i < one.sent.size(); ++i) {
    EXPECT_TRUE(same_content(one.sent[i], two.sent[i]));
    EXPECT_EQ(one.sent[i].time, two.sent[i].time);
  }
}

TEST_P(AnyDevice, DeadDeviceIsSilentUntilItBootsAgain) {
  DeviceBench bench{std::string(GetParam())};
  bench.start_node();
  bench.run(seconds(1));
  bench.sent.clear();
  bench.device->kill();
  EXPECT_FALSE(bench.device->alive());
  EXPECT_EQ(bench.device->next_wake(), kNever);
  EXPECT_FALSE(bench.device->wants_to_send(bench.now));
  bench.nmt(nmt::Command::reset_node);
  bench.sync();
  bench.run(seconds(2));
  EXPECT_TRUE(bench.sent.empty());
  bench.device->revive(bench.now);
  bench.run(Duration{});
  EXPECT_EQ(bench.take(0x705).size(), 1U);
  EXPECT_EQ(bench.device->node().state(), nmt::State::pre_operational);
}

TEST_P(AnyDevice, WhatIsStoredSurvivesPowerOff) {
  DeviceBench bench{std::string(GetParam())};
  const auto power_cycle = [&bench] {
    bench.device->kill();
    bench.run(seconds(1));
    bench.device->revive(bench.now);
    bench.run(Duration{});
    bench.sent.clear();
  };
  bench.write({0x1017, 0}, 50);
  bench.write({0x1020, 1}, 15'000);
  bench.write({0x1010, 1}, 0x6576'6173);
  bench.write({0x1017, 0}, 60);
  power_cycle();
  EXPECT_EQ(bench.value({0x1017, 0}), 50U);
  EXPECT_EQ(bench.value({0x1020, 1}), 15'000U);
  bench.write({0x1011, 1}, 0x6461'6F6C);
  power_cycle();
  EXPECT_EQ(bench.value({0x1017, 0}), 0U);
  EXPECT_EQ(bench.value({0x1020, 1}), 0U);
}

INSTANTIATE_TEST_SUITE_P(All, AnyDevice, testing::ValuesIn(profiles().begin(), profiles().end()));

TEST(Device, HeartbeatAskedForSurvivesAReset) {
  DeviceOptions options;
  options.profile = "encoder";
  options.node_id = 9;
  options.heartbeat = milliseconds(100);
  auto made = Device::make(options);
  ASSERT_TRUE(made.ok());
  Device& device = **made.value;
  device.start(Instant{});
  EXPECT_EQ(device.dictionary().number({0x1017, 0}), 100U);
  const can::Frame reset = can::make_frame(can::kNmtId, {0x81, 9});
  device.receive({&reset, 1});
  EXPECT_EQ(device.dictionary().number({0x1017, 0}), 100U);
}

TEST(Device, UnknownProfileAndNodeIdAreExplained) {
  DeviceOptions options;
  options.profile = "toaster";
  options.node_id = 0;
  const auto made = Device::make(options);
  EXPECT_FALSE(made.ok());
  ASSERT_EQ(made.diagnostics.size(), 2U);
  EXPECT_THAT(made.diagnostics[0].text,
              HasSubstr("unknown profile \"toaster\": known are digital"));
  EXPECT_THAT(made.diagnostics[1].text, HasSubstr("node-ID 0"));
}

}  // namespace
}  // namespace linegate::sim
