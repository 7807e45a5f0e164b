// SPDX-License-Identifier: Apache-2.0
// What the CANopenIA records of the own dictionary ask of the line and order of it.
#include <algorithm>
#include <utility>

#include "stack/base/byte_order.h"
#include "stack/line/line_impl.h"
#include "stack/pdo/parameters.h"

namespace linegate::line {

diagnosis::RecordHost::Transmission Line::Impl::transmission() const {
  return {.fd = load.wants_fast(),
          .waiting = !node.transmit().empty() || !node.pdos().quiet(),
          .overrun = node.transmit().refused() != 0};
}

AbortCode Line::Impl::may_scan(std::uint8_t id) const {
  if (id == config.node_id) {
    return AbortCode::invalid_value;
  }
  if (!manages()) {
    return AbortCode::local_control;
  }
  return usable() && !scanner.active() ? AbortCode::none : AbortCode::device_state;
}

AbortCode Line::Impl::may_trigger(std::uint8_t id, std::uint8_t number) const {
  const Command command{.kind = CommandKind::pdo_trigger, .node = id, .code = number, .data = {}};
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

AbortCode Line::Impl::transmit(const can::Frame& frame) {
  if (uses_identifier(node, plan.tpdos, frame)) {
    return AbortCode::local_control;
  }
  return usable() && send_generic(node, frame) == Error{} ? AbortCode::none
                                                          : AbortCode::device_state;
}

// What has become impossible since it was checked is not done: a command came in between.
void Line::Impl::follow_records(Instant now) {
  using Kind = diagnosis::CanopenIa::OrderKind;
  for (diagnosis::CanopenIa::Order order; canopen_ia.take(order);) {
    Command command{.node = order.node, .code = order.rpdo, .data = {}};
    if (order.kind == Kind::nmt) {
      command.kind = CommandKind::nmt;
      command.nmt = order.command;
      (void)send_nmt(command, now);
    } else if (order.kind == Kind::trigger) {
      command.kind = CommandKind::pdo_trigger;
      std::vector<std::uint16_t> triggered;
      (void)trigger_pdos(command, triggered, now);
    } else if (begin_scan(order.node, 0, now)) {
      take_completions(now);
      finish_scan();
    }
  }
  if (canopen_ia.take_pdo_times()) {
    set_pdo_times();
  }
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
  set_pdo_times();
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

// PDOs without a record keep what the plan has.
void Line::Impl::set_pdo_times() {
  constexpr std::uint8_t kType = 2;
  constexpr std::uint8_t kInhibit = 3;
  constexpr std::uint8_t kEventTimer = 5;
  const diagnosis::ControlSettings& settings = canopen_ia.settings();
  od::Dictionary& dictionary = node.dictionary();
  const auto set = [&dictionary](od::Address address, std::optional<std::uint16_t> time) {
    if (time && dictionary.number(address) != *time) {
      (void)dictionary.set(address, *time);
    }
  };
  const std::uint16_t first = pdo::communication_base(pdo::PdoKind::tpdo);
  for (std::uint16_t index = first; index < first + pdo::kMaxPdo; ++index) {
    const auto type = dictionary.number({index, kType});
    if (type && pdo::is_event_driven(static_cast<std::uint8_t>(*type))) {
      set({index, kInhibit}, settings.inhibit_time);
      set({index, kEventTimer}, settings.event_time);
    }
  }
}

}  // namespace linegate::line
