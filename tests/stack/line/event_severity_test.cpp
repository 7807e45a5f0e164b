// SPDX-License-Identifier: Apache-2.0
#include "stack/line/event_severity.h"

#include <gtest/gtest.h>

#include "stack/lss/assigner.h"
#include "stack/manager/state.h"

namespace linegate::line {
namespace {

TEST(EventSeverityOf, ABootThatFailedIsAnError) {
  for (const char letter : {manager::kBooted, manager::kWasOperational}) {
    EXPECT_EQ(severity_of(event::BootResult{.letter = letter}), EventSeverity::info);
  }
  for (const char letter : {'A', 'B', 'J', 'K', 'O', 'R', 'S'}) {
    EXPECT_EQ(severity_of(event::BootResult{.letter = letter}), EventSeverity::error) << letter;
  }
}

TEST(EventSeverityOf, SoIsANetworkThatDoesNotStart) {
  using manager::ManagerState;
  for (const auto state : {ManagerState::booting, ManagerState::running, ManagerState::stopped}) {
    EXPECT_EQ(severity_of(event::ManagerState{.state = state}), EventSeverity::info);
  }
  EXPECT_EQ(severity_of(event::ManagerState{.state = ManagerState::halted}), EventSeverity::error);
  EXPECT_EQ(severity_of(event::ManagerState{.state = ManagerState::missing_mandatory}),
            EventSeverity::error);
}

TEST(EventSeverityOf, ADeviceWithoutItsNodeIdIsAWarning) {
  EXPECT_EQ(severity_of(event::LssResult{.verdict = lss::Verdict::given}), EventSeverity::info);
  EXPECT_EQ(severity_of(event::LssResult{.verdict = lss::Verdict::not_stored}),
            EventSeverity::warning);
  EXPECT_EQ(severity_of(event::LssResult{.verdict = lss::Verdict::unknown_device}),
            EventSeverity::warning);
}

TEST(EventSeverityOf, OthersAreAsTheirKindIs) {
  EXPECT_EQ(severity_of(event::HeartbeatLost{}), EventSeverity::error);
  EXPECT_EQ(severity_of(event::Emcy{.code = 0x8110}), EventSeverity::warning);
  EXPECT_EQ(severity_of(event::BootUp{}), EventSeverity::info);
}

}  // namespace
}  // namespace linegate::line
