// SPDX-License-Identifier: Apache-2.0
#include "stack/lss/fastscan.h"

#include <algorithm>
#include <memory>
#include <random>

#include <gtest/gtest.h>

#include "tests/stack/lss/slaves.h"

namespace linegate::lss {
namespace {

using testing::Subject;

// Slaves on a bus that loses each request and each response with the same probability.
class Network {
 public:
  explicit Network(double loss = 0.0, std::uint32_t seed = 1) : lost_(loss), random_(seed) {}

  void add(const Address& address) {
    slaves_.push_back(std::make_unique<Subject>(Settings{}, address));
  }
  bool ask(const Message& message) {
    ++questions;
    bool heard = false;
    const can::Frame question = encode(kMasterId, message);
    if (lost_(random_)) {
      return false;  // the request is lost
    }
    for (const auto& subject : slaves_) {
      subject->slave.receive(question, subject->out);
      const bool answers = !subject->answers().empty();
      heard = heard || (answers && !lost_(random_));
    }
    return heard;
  }
  Fastscan run(const Known& known = {}) {
    Fastscan scan(known);
    while (scan.state() == Fastscan::State::running) {
      scan.answered(ask(scan.question()));
    }
    return scan;
  }
  SlaveState state(std::size_t i) const { return slaves_[i]->slave.state(); }

  int questions = 0;

 private:
  std::bernoulli_distribution lost_;
  std::mt19937 random_;
  std::vector<std::unique_ptr<Subject>> slaves_;
};

TEST(Fastscan, FindsNobodyWhereNobodyIs) {
  Network network;
  EXPECT_EQ(network.run().state(), Fastscan::State::nobody);
  EXPECT_EQ(network.questions, 3) << "repeated in case of a loss";
}

TEST(Fastscan, FindsAnAddressBitByBit) {
  Network network;
  network.add(testing::kAddress);
  const Fastscan scan = network.run();
  EXPECT_EQ(scan.state(), Fastscan::State::found);
  EXPECT_EQ(scan.address(), testing::kAddress);
  EXPECT_EQ(network.state(0), SlaveState::configuration);
  EXPECT_EQ(network.questions, 1 + 4 * 33);
}

TEST(Fastscan, FindsEachOfManyOneAfterTheOther) {
  std::mt19937 random(7);
  Network network;
  std::vector<Address> there{{0, 0, 0, 0}, {~0U, ~0U, ~0U, ~0U}, {0, 0, 0, 1}};
  while (there.size() < 20) {
    there.push_back({static_cast<std::uint32_t>(random() & 3U),
                     static_cast<std::uint32_t>(random()), static_cast<std::uint32_t>(random()),
                     static_cast<std::uint32_t>(random())});
  }
  for (const Address& address : there) {
    network.add(address);
  }
  std::vector<Address> found;
  for (std::size_t i = 0; i < there.size(); ++i) {
    const Fastscan scan = network.run();
    ASSERT_EQ(scan.state(), Fastscan::State::found);
    found.push_back(scan.address());
  }
  EXPECT_EQ(network.run().state(), Fastscan::State::nobody);
  std::ranges::sort(found);
  std::ranges::sort(there);
  EXPECT_EQ(found, there);
}

TEST(Fastscan, AsksForKnownPartsAtOnce) {
  Network network;
  network.add(testing::kAddress);
  EXPECT_EQ(network.run({testing::kAddress[0] + 1, {}, {}, {}}).state(), Fastscan::State::nobody);
  network.questions = 0;
  const Fastscan scan =
      network.run({testing::kAddress[0], testing::kAddress[1], testing::kAddress[2], {}});
  EXPECT_EQ(scan.state(), Fastscan::State::found);
  EXPECT_EQ(scan.address(), testing::kAddress);
  EXPECT_EQ(network.questions, 1 + 3 + 33);
}

TEST(Fastscan, WhatItFindsOnABusThatLosesFramesIsRightOrUnsure) {
  int found = 0;
  for (std::uint32_t seed = 1; seed <= 200; ++seed) {
    Network network(0.03, seed);
    network.add(testing::kAddress);
    const Fastscan scan = network.run();
    if (scan.state() == Fastscan::State::found) {
      EXPECT_EQ(scan.address(), testing::kAddress) << "seed " << seed;
      ++found;
    } else {
      EXPECT_TRUE(scan.state() == Fastscan::State::unsure ||
                  scan.state() == Fastscan::State::nobody)
          << "seed " << seed;
    }
  }
  EXPECT_GT(found, 100);
}

}  // namespace
}  // namespace linegate::lss
