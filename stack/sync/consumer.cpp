// SPDX-License-Identifier: Apache-2.0
#include "stack/sync/consumer.h"

#include <utility>

#include "stack/base/assert.h"

namespace linegate::sync {

Consumer::Consumer(can::Dispatch& dispatch, EventLog& events)
    : dispatch_(dispatch), events_(events) {
}

Consumer::~Consumer() {
  register_cob_id(false);
}

void Consumer::configure(const Parameters& parameters) {
  register_cob_id(false);
  parameters_ = parameters;
  register_cob_id(consumes());
  deadline_ = kNever;
  lost_ = false;
  length_was_wrong_ = false;
}

void Consumer::set_active(bool active) {
  active_ = active;
  deadline_ = kNever;
  lost_ = false;
}

void Consumer::advance(Instant now) {
  if (deadline_ <= now) {
    lose();
  }
}

void Consumer::lose() {
  LINEGATE_ASSERT(active_ && consumes(), "only an active consumer misses a SYNC");
  const Instant deadline = std::exchange(deadline_, kNever);
  lost_ = true;
  events_.emit({.time = deadline,
                .node = node_id_,
                .data = event::SyncLost{
                    std::chrono::duration_cast<std::chrono::microseconds>(parameters_.period)}});
}

void Consumer::register_cob_id(bool wanted) {
  if (registered_ == wanted) {
    return;
  }
  registered_ = wanted;
  const can::CobId cob_id = parameters_.cob_id;
  if (wanted) {
    dispatch_.add(cob_id.id(), cob_id.extended(), can::Service::sync, 0);
  } else {
    dispatch_.remove(cob_id.id(), cob_id.extended(), can::Service::sync, 0);
  }
}

}  // namespace linegate::sync
