// SPDX-License-Identifier: Apache-2.0
#include "stack/diagnosis/network_state.h"

#include <gtest/gtest.h>

namespace linegate::diagnosis {
namespace {

using manager::ManagerState;

class NetworkStateTest : public testing::Test {
 protected:
  void SetUp() override {
    facts_.running = true;
    facts_.manages = true;
    facts_.own = nmt::State::pre_operational;
    facts_.starts_nodes = true;
  }
  std::uint8_t value() {
    state_.update(facts_);
    return state_.value(facts_);
  }
  void initialise() {
    facts_.manager = ManagerState::resetting;
    facts_.booting = true;
    state_.begin();
  }
  void boot() {
    facts_.manager = ManagerState::running;
    facts_.booting = false;
  }

  NetworkFacts facts_;
  NetworkState state_;
};

TEST_F(NetworkStateTest, WithoutCommunicationItIsInit) {
  facts_.running = false;
  EXPECT_EQ(value(), 0x00);
  facts_.running = true;
  facts_.own = nmt::State::initialising;
  EXPECT_EQ(value(), 0x00);
}

TEST_F(NetworkStateTest, AMasterThatHasNotBegunIsInReset) {
  EXPECT_EQ(value(), 0x40);
  facts_.manager = ManagerState::stopped;
  EXPECT_EQ(value(), 0x40);
  facts_.running = false;
  EXPECT_EQ(value(), 0x40) << "the devices keep their states";
}

TEST_F(NetworkStateTest, ASlaveShowsItsOwnState) {
  facts_.manages = false;
  facts_.own = nmt::State::stopped;
  EXPECT_EQ(value(), 0x41);
  facts_.own = nmt::State::pre_operational;
  EXPECT_EQ(value(), 0x42);
  facts_.own = nmt::State::operational;
  EXPECT_EQ(value(), 0x43);
}

TEST_F(NetworkStateTest, TheStepsOfTheInitialisation) {
  initialise();
  EXPECT_EQ(state_.value(facts_), 0x61);
  EXPECT_EQ(value(), 0x62);
  facts_.manager = ManagerState::booting;
  EXPECT_EQ(value(), 0x64);
  boot();
  EXPECT_EQ(value(), 0x80) << "the own node is not started";
  facts_.some_operational = true;
  EXPECT_EQ(value(), 0x84);
  facts_.own = nmt::State::operational;
  EXPECT_EQ(value(), 0xAC);
}

TEST_F(NetworkStateTest, WhereTheApplicationStartsTheNodesItWaitsForThat) {
  facts_.starts_nodes = false;
  initialise();
  boot();
  facts_.own = nmt::State::operational;
  EXPECT_EQ(value(), 0x88);
  state_.commanded(nmt::Command::start, facts_);
  EXPECT_EQ(value(), 0xA8);
}

TEST_F(NetworkStateTest, AMissingMandatoryNodeHoldsItUntilTheBootTimeIsOver) {
  initialise();
  boot();
  facts_.manager = ManagerState::missing_mandatory;
  facts_.mandatory_wrong = true;
  EXPECT_EQ(value(), 0x70);
  facts_.manager = ManagerState::booting;
  EXPECT_EQ(value(), 0x70) << "a late node is being booted";
  facts_.manager = ManagerState::missing_mandatory;
  facts_.boot_time_over = true;
  EXPECT_EQ(value(), 0x82);
  state_.commanded(nmt::Command::start, facts_);
  EXPECT_EQ(value(), 0x82) << "a mandatory node is wrong";
}

TEST_F(NetworkStateTest, CommandsToAllNodesMakeTheMainState) {
  initialise();
  state_.commanded(nmt::Command::stop, facts_);
  boot();
  facts_.own = nmt::State::operational;
  EXPECT_EQ(value(), 0xA8) << "a command during initialisation has no effect";
  state_.commanded(nmt::Command::stop, facts_);
  EXPECT_EQ(value(), 0xC8);
  state_.commanded(nmt::Command::enter_pre_operational, facts_);
  EXPECT_EQ(value(), 0xE8);
  state_.commanded(nmt::Command::start, facts_);
  EXPECT_EQ(value(), 0xA8);
  state_.commanded(nmt::Command::reset_node, facts_);
  facts_.booting = true;
  EXPECT_EQ(value(), 0x64);
}

TEST_F(NetworkStateTest, BitsOfTheLowNibble) {
  initialise();
  boot();
  facts_.own = nmt::State::operational;
  facts_.some_operational = true;
  ASSERT_EQ(value(), 0xAC);
  facts_.optional_wrong = true;
  EXPECT_EQ(value(), 0xAD);
  facts_.mandatory_wrong = true;
  facts_.manager = ManagerState::missing_mandatory;
  EXPECT_EQ(value(), 0xAF) << "a started network keeps its main state";
}

TEST_F(NetworkStateTest, AScanIsAutoConfiguration) {
  initialise();
  boot();
  facts_.own = nmt::State::operational;
  ASSERT_EQ(value(), 0xA8);
  facts_.scanning = true;
  EXPECT_EQ(value(), 0x65);
  facts_.scanning = false;
  EXPECT_EQ(value(), 0xA8);
}

TEST_F(NetworkStateTest, AFatalErrorLastsUntilTheNextInitialisation) {
  initialise();
  boot();
  state_.fail();
  EXPECT_EQ(value(), 0x90);
  state_.commanded(nmt::Command::start, facts_);
  EXPECT_EQ(value(), 0x90);
  state_.commanded(nmt::Command::reset_communication, facts_);
  EXPECT_EQ(value(), 0x80);
}

TEST(NetworkStateNames, OfEveryState) {
  EXPECT_EQ(name_of_network_state(0x64), "boot-conf");
  EXPECT_EQ(name_of_network_state(0xA8), "run");
  EXPECT_EQ(name_of_network_state(0x8F), "clear");
  EXPECT_EQ(name_of_network_state(0x90), "fatal-error");
  EXPECT_EQ(name_of_network_state(0x91), "unknown");
  EXPECT_EQ(name_of_network_state(0x65), "boot-auto");
}

}  // namespace
}  // namespace linegate::diagnosis
