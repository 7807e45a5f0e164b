// SPDX-License-Identifier: Apache-2.0
#include "stack/diagnosis/node_status.h"

#include <gtest/gtest.h>

namespace linegate::diagnosis {
namespace {

TEST(NodeStatus, IsTheLastThatBecameKnown) {
  NodeStatus status;
  EXPECT_FALSE(status.of(5));
  const auto after = [&](const EventData& data) {
    status.note({.node = 5, .data = data});
    return status.of(5).value_or(0xFF);
  };
  EXPECT_EQ(after(event::BootUp{}), 0x00);
  EXPECT_EQ(after(event::NodeState{.state = nmt::State::pre_operational}), 0x7F);
  EXPECT_EQ(after(event::NodeState{.state = nmt::State::operational}), 0x05);
  EXPECT_EQ(after(event::NodeState{.state = nmt::State::stopped}), 0x04);
  EXPECT_EQ(after(event::Emcy{.code = 0x8110}), 0x80);
  EXPECT_EQ(after(event::Emcy{.code = 0x0000}), 0x81);
  EXPECT_EQ(after(event::HeartbeatLost{}), 0x91);
  EXPECT_EQ(after(event::HeartbeatRecovered{}), 0x90);
  status.scan_begins(5);
  EXPECT_EQ(status.of(5), 0x9F);
  EXPECT_EQ(after(event::NodeScanned{}), 0xA0);
  EXPECT_EQ(after(event::NodeScanned{.abort = AbortCode::timeout}), 0xA8);
  EXPECT_EQ(after(event::PdoTimeout{}), 0xA8) << "the event has no status";
  status.commanded(nmt::Command::reset_node, 5);
  EXPECT_EQ(status.of(5), 0xB0);
  status.commanded(nmt::Command::start, 5);
  EXPECT_EQ(status.of(5), 0xB0) << "wait for its error control";
}

TEST(NodeStatus, WhoIsNotThereWhenAScanEndsWasNotScanned) {
  NodeStatus status;
  status.note({.node = 5, .data = event::BootUp{}});
  status.note({.node = 6, .data = event::BootUp{}});
  status.scan_begins(0);
  status.note({.node = 5, .data = event::NodeScanned{}});
  status.scan_ends();
  EXPECT_EQ(status.of(5), 0xA0);
  EXPECT_EQ(status.of(6), 0xA8);
  EXPECT_FALSE(status.of(7));
}

TEST(NodeStatus, CommandsToAllAreForThoseThatAreKnown) {
  NodeStatus status;
  status.note({.node = 5, .data = event::BootUp{}});
  status.commanded(nmt::Command::reset_communication, 0);
  EXPECT_EQ(status.of(5), 0xB1);
  EXPECT_FALSE(status.of(6));
}

}  // namespace
}  // namespace linegate::diagnosis
