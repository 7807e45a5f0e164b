// SPDX-License-Identifier: Apache-2.0
#include "stack/line/event_severity.h"

#include "stack/lss/assigner.h"
#include "stack/manager/state.h"
#include "stack/srdo/receiver.h"

namespace linegate::line {

EventSeverity severity_of(const EventData& data) {
  using manager::ManagerState;
  bool raised = false;
  auto to = EventSeverity::error;
  if (const auto* const result = std::get_if<event::BootResult>(&data)) {
    raised = !manager::is_booted(result->letter) || result->letter == manager::kNotStarted;
  } else if (const auto* const change = std::get_if<event::ManagerState>(&data)) {
    raised =
        change->state == ManagerState::halted || change->state == ManagerState::missing_mandatory;
  } else if (const auto* const lss = std::get_if<event::LssResult>(&data)) {
    raised = lss->verdict != lss::Verdict::given;
    to = EventSeverity::warning;
  } else if (const auto* const journal = std::get_if<event::JournalState>(&data)) {
    raised = journal->condition == event::JournalCondition::failing || journal->error != 0 ||
             journal->lost != 0;
  } else if (const auto* const connection = std::get_if<event::SdoConnection>(&data)) {
    using event::ConnectionResult;
    raised = connection->result == ConnectionResult::failed ||
             connection->result == ConnectionResult::lost ||
             connection->result == ConnectionResult::stale;
    to = EventSeverity::warning;
  }
  if (const auto* const srdo = std::get_if<event::SrdoState>(&data)) {
    return srdo->fault == srdo::Fault::none ? EventSeverity::info : EventSeverity::warning;
  }
  return raised ? to : severity(linegate::kind(data));
}

}  // namespace linegate::line
