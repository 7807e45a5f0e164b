// SPDX-License-Identifier: Apache-2.0
#include "bridges/sim/drive_state.h"

#include <set>
#include <utility>

#include <gtest/gtest.h>

namespace linegate::sim {
namespace {

using enum DriveState;

// Controlwords, each with its command in CiA 402.
constexpr std::uint16_t kShutdown = 0x06;
constexpr std::uint16_t kSwitchOn = 0x07;
constexpr std::uint16_t kDisableVoltage = 0x00;
constexpr std::uint16_t kQuickStop = 0x02;
constexpr std::uint16_t kEnableOperation = 0x0F;
constexpr std::uint16_t kFaultReset = 0x80;

struct Row {
  int transition;
  DriveState from;
  std::uint16_t controlword;
  DriveState to;
};

constexpr Row kRows[] = {
    {2, switch_on_disabled, kShutdown, ready_to_switch_on},
    {3, ready_to_switch_on, kSwitchOn, switched_on},
    {4, switched_on, kEnableOperation, operation_enabled},
    {5, operation_enabled, kSwitchOn, switched_on},
    {6, switched_on, kShutdown, ready_to_switch_on},
    {7, ready_to_switch_on, kDisableVoltage, switch_on_disabled},
    {7, ready_to_switch_on, kQuickStop, switch_on_disabled},
    {8, operation_enabled, kShutdown, ready_to_switch_on},
    {9, operation_enabled, kDisableVoltage, switch_on_disabled},
    {10, switched_on, kDisableVoltage, switch_on_disabled},
    {10, switched_on, kQuickStop, switch_on_disabled},
    {11, operation_enabled, kQuickStop, quick_stop_active},
    {12, quick_stop_active, kDisableVoltage, switch_on_disabled},
    {15, fault, kFaultReset, switch_on_disabled},
    {16, quick_stop_active, kEnableOperation, operation_enabled},
    {3, ready_to_switch_on, kEnableOperation, operation_enabled},
};

TEST(DriveState, EveryTransitionOfTheTable) {
  for (const Row& row : kRows) {
    EXPECT_EQ(after(row.from, drive_command(row.controlword, 0)), row.to)
        << "transition " << row.transition;
  }
}

TEST(DriveState, NothingElseChangesTheState) {
  std::set<std::pair<DriveState, DriveCommand>> listed;
  for (const Row& row : kRows) {
    listed.insert({row.from, drive_command(row.controlword, 0)});
  }
  for (int state = 0; state <= static_cast<int>(fault); ++state) {
    for (int command = 0; command <= static_cast<int>(DriveCommand::fault_reset); ++command) {
      const auto from = static_cast<DriveState>(state);
      const auto what = static_cast<DriveCommand>(command);
      if (!listed.contains({from, what})) {
        EXPECT_EQ(after(from, what), from) << state << " " << command;
      }
    }
  }
}

TEST(DriveState, FaultResetIsARisingEdge) {
  EXPECT_EQ(drive_command(0x80, 0x00), DriveCommand::fault_reset);
  EXPECT_EQ(drive_command(0x80, 0x80), DriveCommand::none);
  EXPECT_EQ(drive_command(0x8F, 0x80), DriveCommand::none);
  EXPECT_EQ(drive_command(0x0F, 0x80), DriveCommand::enable_operation);
}

TEST(DriveState, UnusedBitsOfTheControlwordDoNotMatter) {
  EXPECT_EQ(drive_command(0xFF76, 0), DriveCommand::shutdown);
  EXPECT_EQ(drive_command(0x011F, 0), DriveCommand::enable_operation);
  EXPECT_EQ(drive_command(0x001A, 0), DriveCommand::quick_stop);
}

TEST(DriveState, StatuswordFollowsTheMasksOfTheTable) {
  struct Mask {
    DriveState state;
    std::uint16_t mask;
    std::uint16_t value;
  };
  const Mask masks[] = {
      {not_ready_to_switch_on, 0x4F, 0x00}, {switch_on_disabled, 0x4F, 0x40},
      {ready_to_switch_on, 0x6F, 0x21},     {switched_on, 0x6F, 0x23},
      {operation_enabled, 0x6F, 0x27},      {quick_stop_active, 0x6F, 0x07},
      {fault_reaction_active, 0x4F, 0x0F},  {fault, 0x4F, 0x08},
  };
  for (const Mask& mask : masks) {
    EXPECT_EQ(status_bits(mask.state) & mask.mask, mask.value);
  }
}

}  // namespace
}  // namespace linegate::sim
