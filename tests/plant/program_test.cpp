// SPDX-License-Identifier: Apache-2.0
// Program download to simulated devices, in virtual time: in the boot process and on command.
#include <algorithm>

#include <gtest/gtest.h>

#include "bridges/sim/program_memory.h"

#include "tests/plant/manager_fixture.h"

namespace linegate::plant {
namespace {

constexpr std::uint32_t kOld = 0x0001'0000;  // what the simulated drive runs
constexpr std::uint32_t kNew = 0x0001'0002;

std::vector<std::byte> program_of(std::uint32_t identification, std::size_t size) {
  std::vector<std::byte> content(size);
  for (std::size_t i = 0; i < size; ++i) {
    content[i] = static_cast<std::byte>(i * 7);
  }
  return sim::make_program(identification, content);
}

class ProgramTest : public ManagerFixture {
 protected:
  LineSeat& run(std::uint32_t expected = 0, bool update = false,
                std::vector<std::byte> program = {}, bool keep_alive = false) {
    line::NodeConfig node = node_of(5, "drive");
    node.software = expected;
    node.update_software = update;
    node.keep_alive = keep_alive;
    if (!program.empty()) {
      node.program = std::make_shared<const std::vector<std::byte>>(std::move(program));
    }
    add(std::move(node), "drive");
    add(node_of(7, "encoder"), "encoder");
    return start();
  }

  // The software identification that the device reports.
  std::uint64_t software(std::uint8_t node = 5) {
    od::Dictionary& dictionary = seat().find(node)->device->dictionary();
    const auto value = dictionary.read({0x1F56, 1});
    return value.ok() ? load_le(*value) : 0;
  }
  const line::NodeState node_state() { return seat().line->node_state(5); }

  std::uint64_t load(std::vector<std::byte> program, std::uint8_t node = 5, std::uint8_t number = 1,
                     Duration timeout = 0s) {
    line::Command command{.timeout = timeout,
                          .request = line::ProgramDownload{
                              .node = node, .number = number, .program = std::move(program)}};
    return execute(std::move(command));
  }
};

TEST_F(ProgramTest, TheExpectedSoftwareIsVerifiedAtBoot) {
  run(kOld);
  EXPECT_EQ(node_state().boot, manager::kBooted);
  EXPECT_EQ(node_state().state, nmt::State::operational);
}

TEST_F(ProgramTest, AnotherSoftwareThatMayNotBeUpdatedIsBootStatusH) {
  run(kNew);
  EXPECT_EQ(node_state().boot, 'H');
  EXPECT_EQ(node_state().finding.object, (od::Address{0x1F56, 1}));
  EXPECT_EQ(node_state().finding.expected, kNew);
  EXPECT_EQ(node_state().finding.found, kOld);
}

TEST_F(ProgramTest, ANodeThatIsKeptAliveIsNotUpdated) {
  run(kNew, true, program_of(kNew, 100), true);
  EXPECT_EQ(node_state().boot, 'H');
  EXPECT_EQ(software(), kOld);
}

TEST_F(ProgramTest, ADeviceWithoutProgramObjectsIsBootStatusG) {
  line::NodeConfig node = node_of(7, "encoder");
  node.software = kNew;
  add(std::move(node), "encoder");
  start();
  EXPECT_EQ(seat().line->node_state(7).boot, 'G');
}

TEST_F(ProgramTest, AnUpdateAtBootEndsWithTheNodeRunningIt) {
  run(kNew, true, program_of(kNew, 20'000));
  pass(10s);
  EXPECT_EQ(software(), kNew);
  EXPECT_EQ(node_state().boot, manager::kBooted);
  EXPECT_EQ(node_state().state, nmt::State::operational);
  EXPECT_EQ(seat().line->node_state(7).state, nmt::State::operational) << "not affected";
}

TEST_F(ProgramTest, AnUpdateThatTheDeviceCannotUseIsBootStatusI) {
  auto broken = program_of(kNew, 2'000);
  broken.back() ^= std::byte{1};
  run(kNew, true, broken);
  pass(5s);
  EXPECT_EQ(node_state().boot, 'I');
  EXPECT_EQ(node_state().finding.object, (od::Address{0x1F57, 1}));
  EXPECT_EQ(node_state().finding.found, 3U << 1U) << "format or CRC error";
}

TEST_F(ProgramTest, OnCommandAProgramIsLoadedWithProgressAndTheNodeBootedAnew) {
  run();
  const std::uint64_t tag = load(program_of(kNew, 200'000));
  pass(500ms);
  EXPECT_EQ(node_state().boot, manager::kBootUnfinished);
  EXPECT_TRUE(wait(tag).ok());
  EXPECT_EQ(software(), kNew);
  pass(2s);
  EXPECT_EQ(node_state().boot, manager::kBooted);
  EXPECT_EQ(node_state().state, nmt::State::operational);
  std::vector<std::uint32_t> told;
  for (const Event& event : seat().events) {
    // Heartbeats of other nodes may be late: a simulated device acknowledges a block immediately,
    // so that the segments of the next block, which have higher priority, leave no gap on the bus.
    EXPECT_FALSE(event.kind() == EventKind::heartbeat_lost && event.node == 5);
    EXPECT_NE(event.kind(), EventKind::unexpected_node);
    if (const auto* const progress = event.get<event::CommandProgress>()) {
      EXPECT_EQ(event.node, 5);
      EXPECT_EQ(progress->command, line::CommandKind::program);
      EXPECT_EQ(progress->total, 200'010U);
      told.push_back(progress->done);
    }
  }
  EXPECT_GE(told.size(), 2U);
  EXPECT_TRUE(std::ranges::is_sorted(told));
}

TEST_F(ProgramTest, WhatTheDeviceSaysOfABadProgramIsTheAnswer) {
  run();
  const line::Reply bad = wait(load(std::vector<std::byte>(200)));
  EXPECT_EQ(bad.error, to_error(AbortCode::hardware));
  EXPECT_EQ(bad.data, (line::ReplyData{line::ProgramFault{{0x1F57, 1}, 4}}))
      << "1F57h: format unknown";
  const line::Reply number = wait(load(program_of(kNew, 10), 5, 9));
  EXPECT_EQ(number.error, to_error(AbortCode::no_sub_index));
  const line::Reply encoder = wait(load(program_of(kNew, 10), 7));
  EXPECT_EQ(encoder.error, to_error(AbortCode::no_object));
  pass(2s);
  EXPECT_EQ(seat().line->node_state(7).state, nmt::State::operational) << "booted again";
}

TEST_F(ProgramTest, IsRefusedWhereItMakesNoSenseAndEndsWithItsTimeOutAndTheLine) {
  run();
  EXPECT_EQ(wait(load({})).error, to_error(line::Refusal::bad_request));
  EXPECT_EQ(wait(load(program_of(kNew, 10), 127)).error, to_error(line::Refusal::bad_request));
  EXPECT_EQ(wait(load(program_of(kNew, 10), 5, 0)).error, to_error(line::Refusal::bad_request));
  const std::uint64_t first = load(program_of(kNew, 200'000), 5, 1, 1s);
  EXPECT_EQ(wait(load(program_of(kNew, 10))).error, to_error(line::Refusal::busy));
  EXPECT_EQ(wait(first).error, to_error(line::Refusal::timed_out));
  pass(2s);
  const std::uint64_t last = load(program_of(kNew, 100'000));
  pass(500ms);
  seat().line->stop(world().now());
  world().settle();
  EXPECT_EQ(wait(last).error, to_error(line::Refusal::cancelled));
  EXPECT_EQ(seat().duplicate_replies, 0U);
}

TEST_F(ProgramTest, ADeviceWhoseLoadingWasCutOffIsLoadedAgain) {
  run();
  const std::uint64_t first = load(program_of(kNew, 200'000));
  pass(1500ms);
  sim::Device& device = *seat().find(5)->device;
  device.kill();
  EXPECT_FALSE(wait(first).ok());
  device.revive(world().now());
  pass(1s);
  EXPECT_TRUE(wait(load(program_of(kNew, 1'000))).ok());
  EXPECT_EQ(software(), kNew);
}

}  // namespace
}  // namespace linegate::plant
