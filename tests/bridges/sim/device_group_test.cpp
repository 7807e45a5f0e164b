// SPDX-License-Identifier: Apache-2.0
#include "bridges/sim/device_group.h"

#include <vector>

#include <gtest/gtest.h>

namespace linegate::sim {
namespace {

std::unique_ptr<Device> device(const char* profile, std::uint8_t node_id) {
  DeviceOptions options;
  options.profile = profile;
  options.node_id = node_id;
  auto made = Device::make(options);
  EXPECT_TRUE(made.ok());
  return std::move(*made.value);
}

std::vector<can::Frame> drain(DeviceGroup& group, Instant now) {
  std::vector<can::Frame> frames;
  can::Frame frame;
  while (group.next_frame(frame, now)) {
    frames.push_back(frame);
  }
  return frames;
}

TEST(DeviceGroup, NodeIdsAreUnique) {
  DeviceGroup group;
  EXPECT_TRUE(group.add(device("encoder", 3)));
  EXPECT_FALSE(group.add(device("drive", 3)));
  EXPECT_EQ(group.devices().size(), 1U);
  EXPECT_EQ(group.find(3)->options().profile, "encoder");
  EXPECT_EQ(group.find(4), nullptr);
}

TEST(DeviceGroup, FramesComeInTheOrderOfTheBus) {
  DeviceGroup group;
  group.add(device("drive", 9));
  group.add(device("encoder", 3));
  group.add(device("digital-io", 6));
  group.start(Instant{});
  EXPECT_TRUE(group.wants_to_send(Instant{}));
  const auto frames = drain(group, Instant{});
  ASSERT_EQ(frames.size(), 3U);
  EXPECT_EQ(frames[0].id, 0x703U);
  EXPECT_EQ(frames[1].id, 0x706U);
  EXPECT_EQ(frames[2].id, 0x709U);
  EXPECT_FALSE(group.wants_to_send(Instant{}));
}

TEST(DeviceGroup, DevicesHearEachOther) {
  DeviceGroup group;
  group.add(device("encoder", 3));
  group.add(device("digital-io", 6));
  // The digital I/O produces SYNC every 10 ms. The encoder answers each with its second TPDO.
  od::Dictionary& producer = group.find(6)->dictionary();
  od::ObjectDescription period;
  period.index = 0x1006;
  period.variables.resize(1);
  period.variables[0].type = od::DataType::unsigned32;
  period.variables[0].value.resize(4);
  ASSERT_TRUE(producer.add(period).ok());
  group.start(Instant{});
  drain(group, Instant{});
  ASSERT_TRUE(producer.set({0x1006, 0}, std::uint32_t{10'000}));
  ASSERT_TRUE(producer.set({0x1005, 0}, std::uint32_t{0x4000'0080}));
  const can::Frame start = can::make_frame(can::kNmtId, {0x01, 0x00});
  group.receive({&start, 1});
  std::size_t syncs = 0;
  std::size_t answers = 0;
  for (int ms = 0; ms <= 100; ++ms) {
    const Instant now{std::chrono::milliseconds(ms)};
    group.advance(now);
    for (const can::Frame& frame : drain(group, now)) {
      syncs += frame.id == can::kSyncId ? 1U : 0U;
      answers += frame.id == 0x283U ? 1U : 0U;
    }
  }
  EXPECT_GE(syncs, 9U);
  EXPECT_EQ(answers, syncs);
}

TEST(DeviceGroup, DeadDeviceTakesItsOfferedFrameWithIt) {
  DeviceGroup group;
  group.add(device("encoder", 3));
  group.add(device("encoder", 4));
  group.start(Instant{});
  can::Frame frame;
  ASSERT_TRUE(group.next_frame(frame, Instant{}));
  EXPECT_EQ(frame.id, 0x703U);
  group.find(4)->kill();
  EXPECT_FALSE(group.wants_to_send(Instant{}));
  EXPECT_FALSE(group.next_frame(frame, Instant{}));
}

}  // namespace
}  // namespace linegate::sim
