// SPDX-License-Identifier: Apache-2.0
#include "stack/line/diagnosis_service.h"

#include <algorithm>
#include <array>

#include <gtest/gtest.h>

#include "stack/diagnosis/network_state.h"
#include "stack/nmt/node_control.h"

#include "tests/stack/line/diagnosed_parts.h"

namespace linegate::line {
namespace {

struct DiagnosisServiceTest : testing::Test {
  std::ptrdiff_t count(EventKind kind) {
    std::array<Event, 64> all;
    const std::size_t taken = parts.events.take(all);
    return std::ranges::count(std::span(all).first(taken), kind, &Event::kind);
  }

  DiagnosedParts parts;
  DiagnosisService& service = parts.diagnosing;
};

TEST_F(DiagnosisServiceTest, AnotherMasterIsReportedByAManager) {
  can::Frame start = nmt::encode({nmt::Command::start, 5});
  start.time = parts.now;
  parts.host.set_manages(false);
  service.nmt_received(0, start);
  EXPECT_EQ(count(EventKind::foreign_manager), 0);
  parts.host.set_manages(true);
  service.nmt_received(0, start);
  service.nmt_received(0, start);
  EXPECT_EQ(count(EventKind::foreign_manager), 1);
}

// Another device with the manager's node-ID is a fatal error of the manager.
TEST_F(DiagnosisServiceTest, AFatalErrorStopsTheNetwork) {
  EXPECT_EQ(service.next_wake(), kNever);
  parts.events.emit(
      {.time = parts.now, .node = parts.config.node_id, .data = event::DuplicateNodeId{}});
  EXPECT_EQ(service.next_wake(), Instant{});
  service.advance(parts.now);
  EXPECT_EQ(parts.manager.state(), ManagerState::halted);
  EXPECT_TRUE(service.diagnosis().fatal());
  EXPECT_EQ(service.diagnosis().network_state(), diagnosis::kFatal);
  EXPECT_EQ(service.next_wake(), kNever);
}

TEST_F(DiagnosisServiceTest, TheFactsAreThoseOfTheServices) {
  service.advance(parts.now);
  EXPECT_EQ(service.diagnosis().own_state(), parts.node.state());
  parts.host.set_manages(false);
  EXPECT_EQ(service.diagnosis().network_state(), diagnosis::kSlavePreOperational);
}

}  // namespace
}  // namespace linegate::line
