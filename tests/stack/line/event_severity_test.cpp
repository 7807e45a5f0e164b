// SPDX-License-Identifier: Apache-2.0
#include "stack/line/event_severity.h"

#include <gtest/gtest.h>

#include "stack/lss/assigner.h"
#include "stack/manager/state.h"

namespace linegate::line {
namespace {

template <class Code>
EventSeverity of(EventKind kind, Code code) {
  return severity_of({.kind = kind, .code = static_cast<std::uint32_t>(code)});
}

TEST(EventSeverityOf, ABootThatFailedIsAnError) {
  for (const char letter : {manager::kBooted, manager::kWasOperational}) {
    EXPECT_EQ(of(EventKind::boot_result, letter), EventSeverity::info);
  }
  for (const char letter : {'A', 'B', 'J', 'K', 'O', 'R', 'S'}) {
    EXPECT_EQ(of(EventKind::boot_result, letter), EventSeverity::error) << letter;
  }
}

TEST(EventSeverityOf, SoIsANetworkThatDoesNotStart) {
  using manager::ManagerState;
  for (const auto state : {ManagerState::booting, ManagerState::running, ManagerState::stopped}) {
    EXPECT_EQ(of(EventKind::manager_state, state), EventSeverity::info);
  }
  EXPECT_EQ(of(EventKind::manager_state, ManagerState::halted), EventSeverity::error);
  EXPECT_EQ(of(EventKind::manager_state, ManagerState::missing_mandatory), EventSeverity::error);
}

TEST(EventSeverityOf, ADeviceWithoutItsNodeIdIsAWarning) {
  EXPECT_EQ(of(EventKind::lss_result, lss::Verdict::given), EventSeverity::info);
  EXPECT_EQ(of(EventKind::lss_result, lss::Verdict::not_stored), EventSeverity::warning);
  EXPECT_EQ(of(EventKind::lss_result, lss::Verdict::unknown_device), EventSeverity::warning);
}

TEST(EventSeverityOf, OthersAreAsTheirKindIs) {
  EXPECT_EQ(of(EventKind::heartbeat_lost, 0), EventSeverity::error);
  EXPECT_EQ(of(EventKind::emcy, 0x8110), EventSeverity::warning);
  EXPECT_EQ(of(EventKind::boot_up, 0), EventSeverity::info);
}

}  // namespace
}  // namespace linegate::line
