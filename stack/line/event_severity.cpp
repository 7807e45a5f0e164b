// SPDX-License-Identifier: Apache-2.0
#include "stack/line/event_severity.h"

#include "stack/lss/assigner.h"
#include "stack/manager/state.h"

namespace linegate::line {
namespace {

constexpr bool is(std::uint32_t code, manager::ManagerState state) {
  return code == static_cast<std::uint32_t>(state);
}

}  // namespace

EventSeverity severity_of(const Event& event) {
  using manager::ManagerState;
  bool raised = false;
  auto to = EventSeverity::error;
  switch (event.kind) {
    case EventKind::boot_result:
      raised = !manager::is_booted(static_cast<char>(event.code)) ||
               event.code == static_cast<std::uint32_t>(manager::kNotStarted);
      break;
    case EventKind::manager_state:
      raised =
          is(event.code, ManagerState::halted) || is(event.code, ManagerState::missing_mandatory);
      break;
    case EventKind::lss_result:
      raised = event.code != static_cast<std::uint32_t>(lss::Verdict::given);
      to = EventSeverity::warning;
      break;
    default:
      break;
  }
  return raised ? to : severity(event.kind);
}

}  // namespace linegate::line
