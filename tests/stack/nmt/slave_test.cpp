// SPDX-License-Identifier: Apache-2.0
#include "stack/nmt/slave.h"

#include <gtest/gtest.h>

namespace linegate::nmt {
namespace {

Slave in_state(State state) {
  Slave slave;
  slave.booted();
  if (state == State::operational) {
    slave.command(Command::start);
  } else if (state == State::stopped) {
    slave.command(Command::stop);
  }
  return slave;
}

TEST(Slave, BootsToPreOperational) {
  Slave slave;
  EXPECT_EQ(slave.state(), State::initialising);
  slave.booted();
  EXPECT_EQ(slave.state(), State::pre_operational);
}

TEST(Slave, ObeysNothingWhileInitialising) {
  Slave slave;
  for (const Command command :
       {Command::start, Command::stop, Command::enter_pre_operational, Command::reset_node}) {
    EXPECT_EQ(slave.command(command), Effect::none);
    EXPECT_EQ(slave.state(), State::initialising);
  }
}

TEST(Slave, EveryCommandInEveryState) {
  for (const State from : {State::pre_operational, State::operational, State::stopped}) {
    const std::pair<Command, State> table[] = {
        {Command::start, State::operational},
        {Command::stop, State::stopped},
        {Command::enter_pre_operational, State::pre_operational}};
    for (const auto& [command, to] : table) {
      Slave slave = in_state(from);
      EXPECT_EQ(slave.command(command), from == to ? Effect::none : Effect::state_changed);
      EXPECT_EQ(slave.state(), to);
    }
    Slave node = in_state(from);
    EXPECT_EQ(node.command(Command::reset_node), Effect::reset_node);
    EXPECT_EQ(node.state(), State::initialising);
    Slave communication = in_state(from);
    EXPECT_EQ(communication.command(Command::reset_communication), Effect::reset_communication);
    EXPECT_EQ(communication.state(), State::initialising);
  }
}

}  // namespace
}  // namespace linegate::nmt
