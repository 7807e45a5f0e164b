// SPDX-License-Identifier: Apache-2.0
// What the CANopenIA records of the own dictionary order, and values for the own node.
#include <algorithm>
#include <utility>

#include "stack/base/byte_order.h"
#include "stack/line/line_impl.h"

namespace linegate::line {

AbortCode Line::Impl::may_trigger(std::uint8_t id, std::uint8_t rpdo) const {
  const Command command{.kind = CommandKind::pdo_trigger, .node = id, .code = rpdo, .data = {}};
  const std::vector<std::uint16_t> tpdos = named_tpdos(command);
  if (tpdos.empty()) {
    return AbortCode::invalid_value;
  }
  const bool complete = std::ranges::any_of(tpdos, [this](std::uint16_t tpdo) {
    return image.pdo_known(image::Direction::outputs, tpdo);
  });
  return complete && node.state() == nmt::State::operational ? AbortCode::none
                                                             : AbortCode::device_state;
}

void Line::Impl::order_nmt(nmt::Command command, std::uint8_t id, Instant now) {
  (void)send_nmt({.kind = CommandKind::nmt, .node = id, .nmt = command, .data = {}}, now);
}

void Line::Impl::order_trigger(std::uint8_t id, std::uint8_t rpdo, Instant now) {
  std::vector<std::uint16_t> triggered;
  (void)trigger_pdos({.kind = CommandKind::pdo_trigger, .node = id, .code = rpdo, .data = {}},
                     triggered, now);
}

// The node boots with the own values: what it is, master or slave (1F80h), is never that of the
// defaults, not for a moment.
void Line::Impl::before_boot(Instant now) {
  for (const CommandKind kind :
       {CommandKind::emcy_send, CommandKind::pdo_trigger, CommandKind::mpdo_write}) {
    refuse_sendings(kind, Refusal::wrong_state, now);
  }
  if (std::exchange(resets, node.counters().resets) != node.counters().resets) {
    own_objects.values_reset();
  }
  write_own_values(now);
  records.apply_pdo_times();
  node.set_nmt_slave(!startup.wants_manager());
  if (!startup.wants_manager()) {
    nmt.set_active(false);
  }
}

void Line::Impl::write_own_values(Instant now) {
  const OwnObjects::OwnWrites by_itself(own_objects);
  for (const ObjectValue& value : config.own_values) {
    const AbortCode why = node.dictionary().write(value.address, value.data);
    if (why == AbortCode::none) {
      continue;
    }
    Event event{.time = now,
                .kind = EventKind::configuration_error,
                .node = config.node_id,
                .length = 3,
                .code = static_cast<std::uint32_t>(why)};
    store_le(event.data.data(), value.address.index);
    event.data[2] = std::byte{value.address.sub};
    events.emit(event);
  }
}

}  // namespace linegate::line
