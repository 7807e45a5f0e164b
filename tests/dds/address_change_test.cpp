// SPDX-License-Identifier: Apache-2.0
#include "bridges/dds/address_change.h"

#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace linegate::dds {
namespace {

using namespace std::chrono_literals;

class AddressChangeTest : public testing::Test {
 protected:
  // A process that was started on this host a while ago.
  AddressChange change(std::vector<std::string> interfaces = {}) {
    AddressChange out(AddressWatch(std::move(interfaces), [this] { return host_; }));
    start(out);
    return out;
  }
  void start(AddressChange& change) {
    change.started(now_);
    pass(change, AddressChange::kPause);
  }
  // Returns the last reason.
  std::string pass(AddressChange& change, Duration time) {
    std::string reason;
    for (; time > Duration::zero(); time -= 100ms) {
      now_ += 100ms;
      if (std::string due = change.due(now_); !due.empty()) {
        reason = std::move(due);
      }
    }
    return reason;
  }
  std::string due(AddressChange& change) { return pass(change, 2 * AddressChange::kLook); }

  AddressWatch::Addresses host_{"eth0 10.0.0.1"};
  Instant now_{1h};
};

TEST_F(AddressChangeTest, WhatWasThereAtTheStartIsNotNew) {
  AddressChange watched = change();
  EXPECT_EQ(due(watched), "");
}

TEST_F(AddressChangeTest, ANewAddressIsNamed) {
  AddressChange watched = change();
  host_.insert("eth1 10.0.1.1");
  EXPECT_EQ(due(watched), "network interface eth1 has the address 10.0.1.1 now");
}

TEST_F(AddressChangeTest, AnotherAddressOfAnInterfaceIsNew) {
  AddressChange watched = change();
  host_ = {"eth0 10.0.0.2"};
  EXPECT_EQ(due(watched), "network interface eth0 has the address 10.0.0.2 now");
}

TEST_F(AddressChangeTest, AnAddressThatGoesAndComesBackIsNotNew) {
  AddressChange watched = change();
  host_.clear();
  EXPECT_EQ(due(watched), "");
  host_ = {"eth0 10.0.0.1"};
  EXPECT_EQ(due(watched), "");
}

// A process that died, or was replaced because of its identity.
TEST_F(AddressChangeTest, AnAddressThatWasNotThereAtALaterStartIsNew) {
  AddressChange watched = change();
  host_.clear();
  start(watched);
  host_ = {"eth0 10.0.0.1"};
  EXPECT_EQ(due(watched), "network interface eth0 has the address 10.0.0.1 now");
}

TEST_F(AddressChangeTest, AnAddressThatGoesBeforeTheParticipantIsCreatedIsNew) {
  AddressChange watched = change();
  watched.started(now_);
  host_.clear();
  pass(watched, 300ms);
  host_ = {"eth0 10.0.0.1"};
  EXPECT_EQ(pass(watched, AddressChange::kPause - 400ms), "") << "it may still be in its start";
  EXPECT_NE(due(watched), "");
}

// The process was started between two looks.
TEST_F(AddressChangeTest, AnAddressThatCameSinceTheLookBeforeTheStartIsNew) {
  AddressChange watched = change();
  host_.insert("eth1 10.0.1.1");
  start(watched);
  EXPECT_EQ(due(watched), "network interface eth1 has the address 10.0.1.1 now");
}

TEST_F(AddressChangeTest, ItRemainsDueUntilTheNextStart) {
  AddressChange watched = change();
  host_.insert("eth1 10.0.1.1");
  EXPECT_NE(due(watched), "");
  EXPECT_NE(due(watched), "");
  watched.ends(now_);
  EXPECT_EQ(pass(watched, AddressChange::kPause - 100ms), "") << "it is asked once";
  start(watched);
  EXPECT_EQ(due(watched), "");
}

TEST_F(AddressChangeTest, InterfacesThatComeAndGoStartItOnceInAWhile) {
  AddressChange watched = change();
  int starts = 0;
  for (int i = 0; i < 600; ++i) {
    host_ = {"eth0 10.0.0." + std::to_string(i)};
    if (!pass(watched, 100ms).empty()) {
      watched.ends(now_);
      watched.started(now_);
      ++starts;
    }
  }
  EXPECT_LE(starts, 60s / AddressChange::kPause);
  EXPECT_GE(starts, 60s / (AddressChange::kPause + AddressChange::kLook) - 1);
}

TEST_F(AddressChangeTest, OnlyConfiguredInterfacesCount) {
  host_.insert("eth1 10.0.1.1");
  AddressChange by_name = change({"eth1", "lo"});
  AddressChange by_address = change({"10.0.1.1"});
  host_.insert("eth2 10.0.2.1");
  EXPECT_EQ(due(by_name), "");
  EXPECT_EQ(due(by_address), "");
  host_.insert("eth1 10.0.1.2");
  EXPECT_NE(due(by_name), "");
  EXPECT_EQ(due(by_address), "");
}

// Without an address for each of them, another participant could not be created.
TEST_F(AddressChangeTest, AWorkingProcessIsNotReplacedWhileAnInterfaceHasNoAddress) {
  host_.insert("eth1 10.0.1.1");
  AddressChange watched = change({"eth0", "eth1"});
  host_ = {"eth1 10.0.1.2"};
  EXPECT_EQ(due(watched), "");
  host_.insert("eth0 10.0.0.1");
  EXPECT_EQ(due(watched), "network interface eth1 has the address 10.0.1.2 now");
}

TEST(UsableAddresses, AreNotThoseOfLoopback) {
  for (const std::string& one : usable_addresses()) {
    EXPECT_FALSE(one.starts_with("lo ")) << one;
  }
}

}  // namespace
}  // namespace linegate::dds
