// SPDX-License-Identifier: Apache-2.0
#include "stack/manager/state_changes.h"

#include <gtest/gtest.h>

namespace linegate::manager {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

class StateChangesTest : public ::testing::Test {
 protected:
  StateChangesTest() {
    node_.node = 5;
    node_.presence = Presence::present;
    node_.state = nmt::State::operational;
  }

  bool shows(nmt::State state) {
    const bool itself = changes_.shows(node_, state);
    node_.state = state;
    return itself;
  }

  bool boots() {
    const bool itself = changes_.boot_up(node_, now_);
    node_.presence = Presence::present;
    node_.state = nmt::State::pre_operational;
    return itself;
  }

  void command(nmt::Command command, std::uint8_t node = 5) {
    changes_.commanded(command, node, now_);
  }

  Instant now_{seconds(1)};
  StateChanges changes_;
  NodeState node_;
};

TEST_F(StateChangesTest, OperationalIsLeftByTheNodeItself) {
  command(nmt::Command::start);
  EXPECT_FALSE(shows(nmt::State::operational));
  EXPECT_TRUE(shows(nmt::State::pre_operational));
  EXPECT_EQ(node_.cause, StateCause::itself);
  EXPECT_EQ(node_.spontaneous_changes, 1U);
  EXPECT_FALSE(shows(nmt::State::pre_operational)) << "reported once";
}

TEST_F(StateChangesTest, OperationalIsLeftByCommand) {
  command(nmt::Command::stop, 0);
  EXPECT_FALSE(shows(nmt::State::stopped));
  EXPECT_EQ(node_.cause, StateCause::command);
  command(nmt::Command::start, 6);
  EXPECT_FALSE(shows(nmt::State::operational));
  EXPECT_EQ(node_.cause, StateCause::itself) << "the command was for another node";
  EXPECT_TRUE(shows(nmt::State::stopped)) << "the stop precedes Operational";
  EXPECT_EQ(node_.spontaneous_changes, 1U);
}

TEST_F(StateChangesTest, ABootUpWithoutAResetIsSpontaneous) {
  EXPECT_TRUE(boots());
  EXPECT_EQ(node_.cause, StateCause::itself);
  now_ += milliseconds(1);
  EXPECT_FALSE(boots()) << "a repeated frame";
  now_ += seconds(1);
  command(nmt::Command::reset_node);
  EXPECT_FALSE(boots());
  EXPECT_EQ(node_.cause, StateCause::command);
  now_ += milliseconds(100);
  EXPECT_TRUE(boots()) << "the boot-up of the reset was received";
  EXPECT_EQ(node_.spontaneous_changes, 2U);
}

TEST_F(StateChangesTest, EachResetHasABootUpMessageOfItsOwn) {
  command(nmt::Command::reset_node);
  command(nmt::Command::reset_communication, 0);
  EXPECT_FALSE(boots());
  now_ += milliseconds(100);
  EXPECT_FALSE(boots());
  now_ += milliseconds(100);
  EXPECT_TRUE(boots());
}

TEST_F(StateChangesTest, AResetThatWasLostIsNoReasonLater) {
  command(nmt::Command::reset_node);
  now_ += seconds(3);
  EXPECT_TRUE(boots());
  command(nmt::Command::reset_node);
  node_.state = nmt::State::unknown;
  now_ += seconds(30);
  EXPECT_FALSE(boots()) << "nothing was received since the reset";
  EXPECT_EQ(node_.cause, StateCause::command);
}

TEST_F(StateChangesTest, ANodeThatIsSwitchedOnDoesNothingByItself) {
  node_.presence = Presence::missing;
  node_.state = nmt::State::unknown;
  EXPECT_FALSE(boots());
  EXPECT_EQ(node_.cause, StateCause::unknown);
  EXPECT_EQ(node_.spontaneous_changes, 0U);
}

}  // namespace
}  // namespace linegate::manager
