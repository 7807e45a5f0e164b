// SPDX-License-Identifier: Apache-2.0
#include "bridges/console/event_progress.h"

#include <algorithm>
#include <utility>
#include <vector>

#include "bridges/console/lookup.h"
#include "bridges/console/table.h"

namespace linegate::console {

EventProgress::EventProgress(Model& model, LineId id, std::ostream& err, Words words)
    : model_(model), id_(std::move(id)), err_(err), words_(std::move(words)), since_(utc_now()) {
}

EventProgress::EventProgress(Model& model, LineId id, std::ostream& err,
                             std::initializer_list<EventKind> kinds)
    : EventProgress(model, std::move(id), err,
                    [wanted = std::vector<EventKind>(kinds)](const EventView& view) {
                      const auto found = std::ranges::find(wanted, view.kind);
                      return found != wanted.end() ? view.text : std::string();
                    }) {
}

void EventProgress::on_event(const LineId& id, const EventView& event) {
  model_.on_event(id, event);
  if (id != id_ || event.time < since_) {
    return;
  }
  const std::string said = words_(event);
  if (!said.empty()) {
    err_ << printable(said) << std::endl;
  }
}

}  // namespace linegate::console
