// SPDX-License-Identifier: Apache-2.0
// The values with which the own node boots.
#include <utility>

#include "stack/line/node_line.h"

namespace linegate::line {

// The node boots with its configured values: its role, master or slave (1F80h), never has the
// default, not even for a moment.
void NodeLine::before_boot(Instant now) {
  for (Service* service : services()) {
    service->before_boot(now);
  }
  if (std::exchange(resets_, node_.counters().resets) != node_.counters().resets) {
    own_objects_.values_reset();
  }
  write_own_values(now);
  services_.records.apply_pdo_times();
  services_.flying.boot(now);
  node_.set_nmt_slave(!wants_manager());
  if (!wants_manager()) {
    nmt_.set_active(false);
  }
}

void NodeLine::write_own_values(Instant now) {
  const OwnObjects::OwnWrites by_itself(own_objects_);
  for (const ObjectValue& value : config_.own_values) {
    const AbortCode why = node_.dictionary().write(value.address, value.data);
    if (why == AbortCode::none) {
      continue;
    }
    events_.emit({.time = now,
                  .node = config_.node_id,
                  .data = event::ConfigurationError{
                      .abort = why, .index = value.address.index, .sub = value.address.sub}});
  }
}

}  // namespace linegate::line
