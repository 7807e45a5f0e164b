// SPDX-License-Identifier: Apache-2.0
// Devices that answer anything, and boot at any time: the invariants of connections.h hold.
#include <random>

#include <gtest/gtest.h>

#include "tests/stack/manager/connection_network.h"

namespace linegate::manager {
namespace {

constexpr std::uint8_t kFirstNode = 1;
constexpr std::uint8_t kLastNode = 4;

class HostileNetwork : public ConnectionNetwork {
 public:
  explicit HostileNetwork(unsigned seed) : ConnectionNetwork({0x680, 0x687}), random_(seed) {
    devices.clear();
    for (std::uint8_t node = kFirstNode; node <= kLastNode; ++node) {
      for (std::uint16_t i = 0; i < 3; ++i) {
        devices[node].add(static_cast<std::uint16_t>(0x1280 + i));
        devices[node].add(static_cast<std::uint16_t>(0x1201 + i));
      }
    }
    answer = [this](std::uint8_t, od::Address, bool) { return any_answer(); };
  }

  void step() {
    const auto node = static_cast<std::uint8_t>(pick(kFirstNode, kLastNode));
    switch (pick(0, 9)) {
      case 0:
        devices[node].store();
        break;
      case 1:
        reset(node);
        break;
      case 2:
        connections.recovered(node, now);
        break;
      case 3:
      case 4:
        if (const auto table = connections.table(); !table.empty()) {
          const auto& one =
              table[static_cast<std::size_t>(pick(0, static_cast<int>(table.size()) - 1))];
          requested_ += connections.close(one.number, {}, now) ? 1 : 0;
        }
        break;
      case 5:
        run();
        break;
      default: {
        const auto other = static_cast<std::uint8_t>(node % kLastNode + 1);
        requested_ +=
            connections.open(node, other, {.timeout = Milliseconds(pick(0, 1) * 700)}, now) != 0
                ? 1
                : 0;
        settle();
      }
    }
  }
  // The devices behave from now on, and boot once.
  void calm_down() {
    answer = {};
    for (std::uint8_t node = kFirstNode; node <= kLastNode; ++node) {
      reset(node);
    }
    run();
  }
  int requested() const { return requested_; }

 private:
  int pick(int least, int most) { return std::uniform_int_distribution<int>(least, most)(random_); }
  Answer any_answer() {
    using Kind = Answer::Kind;
    constexpr std::array kAborts{AbortCode::no_object, AbortCode::no_sub_index, AbortCode::general,
                                 AbortCode::timeout, AbortCode{0}};
    switch (pick(0, 30)) {
      case 0:
        return {Kind::silent};
      case 1:
        return {Kind::executed};
      case 2:
        return {Kind::abort, kAborts[static_cast<std::size_t>(pick(1, 4))]};
      case 3:
        return {Kind::nonsense};
      case 4:
        reset(static_cast<std::uint8_t>(pick(kFirstNode, kLastNode)));
        return {};
      default:
        return {};
    }
  }

  std::mt19937 random_;
  int requested_ = 0;
};

TEST(ConnectionsRandom, WhateverTheDevicesAnswer) {
  for (unsigned seed = 1; seed <= 500 && !testing::Test::HasFailure(); ++seed) {
    SCOPED_TRACE(seed);
    HostileNetwork network(seed);
    for (int i = 0; i < 40; ++i) {
      network.step();
    }
    network.run();
    EXPECT_EQ(static_cast<int>(network.take_ended().size()), network.requested())
        << "each request ends once";
    network.calm_down();
    EXPECT_EQ(network.connections.table().size(), 0U);
    for (const auto& [node, device] : network.devices) {
      for (const auto& [address, value] : device.values()) {
        EXPECT_FALSE(address.sub != 3 && device.valid(address.index)) << int{node};
      }
    }
  }
}

}  // namespace
}  // namespace linegate::manager
