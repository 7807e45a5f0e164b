#include "bridges/console/event_progress.h"

#include <algorithm>
#include <utility>

#include "bridges/console/lookup.h"
#include "bridges/console/table.h"

namespace linegate::console {

EventProgress::EventProgress(Model& model, LineId id, std::ostream& err,
                             std::initializer_list<EventKind> kinds)
    : model_(model), id_(std::move(id)), err_(err), kinds_(kinds), since_(utc_now()) {
}

void EventProgress::on_event(const LineId& id, const EventView& event) {
  model_.on_event(id, event);
  const bool wanted = std::ranges::find(kinds_, event.event.kind) != kinds_.end();
  if (id == id_ && wanted && event.event.time >= since_) {
    err_ << printable(event.text) << std::endl;
  }
}

}  // namespace linegate::console
