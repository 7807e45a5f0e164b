// SPDX-License-Identifier: Apache-2.0
// The values with which the own node boots.
#include <utility>

#include "stack/base/byte_order.h"
#include "stack/line/node_line.h"

namespace linegate::line {

// The node boots with its configured values: its role, master or slave (1F80h), never has the
// default, not even for a moment.
void NodeLine::before_boot(Instant now) {
  for (Service* service : services_) {
    service->before_boot(now);
  }
  if (std::exchange(resets_, node_.counters().resets) != node_.counters().resets) {
    own_objects_.values_reset();
  }
  write_own_values(now);
  records_.apply_pdo_times();
  node_.set_nmt_slave(!startup_.wants_manager());
  if (!startup_.wants_manager()) {
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
    Event event{.time = now,
                .kind = EventKind::configuration_error,
                .node = config_.node_id,
                .length = 3,
                .code = static_cast<std::uint32_t>(why)};
    store_le(event.data.data(), value.address.index);
    event.data[2] = std::byte{value.address.sub};
    events_.emit(event);
  }
}

}  // namespace linegate::line
