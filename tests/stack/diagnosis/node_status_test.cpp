// SPDX-License-Identifier: Apache-2.0
#include "stack/diagnosis/node_status.h"

#include <gtest/gtest.h>

namespace linegate::diagnosis {
namespace {

TEST(NodeStatus, IsTheLastThatBecameKnown) {
  NodeStatus status;
  EXPECT_FALSE(status.of(5));
  const auto after = [&](EventKind kind, std::uint32_t code = 0) {
    status.note({.kind = kind, .node = 5, .code = code});
    return status.of(5).value_or(0xFF);
  };
  EXPECT_EQ(after(EventKind::boot_up), 0x00);
  EXPECT_EQ(after(EventKind::node_state, 0x7F), 0x7F);
  EXPECT_EQ(after(EventKind::node_state, 0x05), 0x05);
  EXPECT_EQ(after(EventKind::node_state, 0x04), 0x04);
  EXPECT_EQ(after(EventKind::emcy, 0x8110), 0x80);
  EXPECT_EQ(after(EventKind::emcy, 0x0000), 0x81);
  EXPECT_EQ(after(EventKind::heartbeat_lost), 0x91);
  EXPECT_EQ(after(EventKind::heartbeat_recovered), 0x90);
  status.scan_begins(5);
  EXPECT_EQ(status.of(5), 0x9F);
  EXPECT_EQ(after(EventKind::node_scanned), 0xA0);
  EXPECT_EQ(after(EventKind::node_scanned, 0x0504'0000), 0xA8);
  EXPECT_EQ(after(EventKind::pdo_timeout), 0xA8) << "the event has no status";
  status.commanded(nmt::Command::reset_node, 5);
  EXPECT_EQ(status.of(5), 0xB0);
  status.commanded(nmt::Command::start, 5);
  EXPECT_EQ(status.of(5), 0xB0) << "wait for its error control";
}

TEST(NodeStatus, WhoIsNotThereWhenAScanEndsWasNotScanned) {
  NodeStatus status;
  status.note({.kind = EventKind::boot_up, .node = 5});
  status.note({.kind = EventKind::boot_up, .node = 6});
  status.scan_begins(0);
  status.note({.kind = EventKind::node_scanned, .node = 5});
  status.scan_ends();
  EXPECT_EQ(status.of(5), 0xA0);
  EXPECT_EQ(status.of(6), 0xA8);
  EXPECT_FALSE(status.of(7));
}

TEST(NodeStatus, CommandsToAllAreForThoseThatAreKnown) {
  NodeStatus status;
  status.note({.kind = EventKind::boot_up, .node = 5});
  status.commanded(nmt::Command::reset_communication, 0);
  EXPECT_EQ(status.of(5), 0xB1);
  EXPECT_FALSE(status.of(6));
}

}  // namespace
}  // namespace linegate::diagnosis
