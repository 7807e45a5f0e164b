// SPDX-License-Identifier: Apache-2.0
#include "gateway/publish/address_change.h"

#include <gtest/gtest.h>

namespace linegate::gateway {
namespace {

using namespace std::chrono_literals;

class AddressChangeTest : public testing::Test {
 protected:
  AddressChange watch(std::vector<std::string> interfaces = {}) {
    return {std::move(interfaces), [this] { return host_; }};
  }
  std::string due_later(AddressChange& change) {
    now_ += AddressChange::kLook;
    return change.due(now_);
  }

  AddressChange::Addresses host_{"lo 127.0.0.1", "eth0 10.0.0.1"};
  Instant now_{1h};
};

TEST_F(AddressChangeTest, WhatWasThereAtTheStartIsNotNew) {
  AddressChange change = watch();
  EXPECT_EQ(due_later(change), "");
}

TEST_F(AddressChangeTest, ANewAddressIsNamed) {
  AddressChange change = watch();
  host_.insert("eth1 10.0.1.1");
  EXPECT_EQ(due_later(change), "network interface eth1 has the address 10.0.1.1 now");
}

TEST_F(AddressChangeTest, AnotherAddressOfAnInterfaceIsNew) {
  AddressChange change = watch();
  host_.erase("eth0 10.0.0.1");
  host_.insert("eth0 10.0.0.2");
  EXPECT_EQ(due_later(change), "network interface eth0 has the address 10.0.0.2 now");
}

TEST_F(AddressChangeTest, AnAddressThatGoesAndComesBackIsNotNew) {
  AddressChange change = watch();
  host_.erase("eth0 10.0.0.1");
  EXPECT_EQ(due_later(change), "");
  host_.insert("eth0 10.0.0.1");
  EXPECT_EQ(due_later(change), "");
}

TEST_F(AddressChangeTest, AfterAStartAnAddressThatWasNotThereThenIsNew) {
  AddressChange change = watch();
  host_ = {"eth1 10.0.1.1"};
  EXPECT_NE(due_later(change), "");
  change.done(now_);
  now_ += AddressChange::kPause;
  EXPECT_EQ(due_later(change), "");
  host_ = {"eth0 10.0.0.1", "eth1 10.0.1.1"};
  EXPECT_EQ(due_later(change), "network interface eth0 has the address 10.0.0.1 now");
}

TEST_F(AddressChangeTest, ItRemainsDueUntilDone) {
  AddressChange change = watch();
  host_.insert("eth1 10.0.1.1");
  EXPECT_NE(due_later(change), "");
  EXPECT_NE(due_later(change), "");
}

TEST_F(AddressChangeTest, InterfacesThatComeAndGoStartItOnceInAWhile) {
  AddressChange change = watch();
  int starts = 0;
  for (int i = 0; i < 60; ++i) {
    host_ = {"eth0 10.0.0." + std::to_string(i + 2)};
    if (!due_later(change).empty()) {
      change.done(now_);
      ++starts;
    }
  }
  EXPECT_EQ(starts, 60s / AddressChange::kPause);
}

TEST_F(AddressChangeTest, OnlyConfiguredInterfacesCount) {
  AddressChange by_name = watch({"eth1"});
  AddressChange by_address = watch({"10.0.1.1"});
  host_.insert("eth2 10.0.2.1");
  now_ += AddressChange::kLook;
  EXPECT_EQ(by_name.due(now_), "");
  EXPECT_EQ(by_address.due(now_), "");
  host_.insert("eth1 10.0.1.1");
  now_ += AddressChange::kLook;
  EXPECT_NE(by_name.due(now_), "");
  EXPECT_NE(by_address.due(now_), "");
}

}  // namespace
}  // namespace linegate::gateway
