// SPDX-License-Identifier: Apache-2.0
#include "stack/line/record_service.h"

#include "stack/line/build.h"
#include "stack/line/generic_can.h"
#include "stack/line/scan_service.h"
#include "stack/pdo/parameters.h"

namespace linegate::line {

RecordService::RecordService(ServiceHost& host, const LineConfig& config, const Parts& parts)
    : Service(host),
      config_(config),
      parts_(parts),
      records_(parts.node.dictionary(), parts.diagnosis, *this, canopen_ia_options(config)) {
}

void RecordService::carry_out_orders(Instant now, std::uint32_t client) {
  for (diagnosis::CanopenIa::Order order; records_.take(order);) {
    carry_out(order, now, client);
  }
}

void RecordService::advance(Instant now) {
  carry_out_orders(now, 0);
  if (records_.pop_pdo_times_written()) {
    apply_pdo_times();
  }
}

// An order that a command has made impossible since it was checked is dropped.
void RecordService::carry_out(const diagnosis::CanopenIa::Order& order, Instant now,
                              std::uint32_t client) {
  using Kind = diagnosis::CanopenIa::OrderKind;
  switch (order.kind) {
    case Kind::nmt:
      parts_.orders.order_nmt(order.command, order.node, now, client);
      return;
    case Kind::trigger:
      parts_.orders.order_trigger(order.node, order.rpdo, now);
      return;
    case Kind::scan:
      if (may_scan(order.node) == AbortCode::none) {
        (void)parts_.scanning.begin(order.node, now, client);
      }
      return;
  }
}

void RecordService::heartbeat(std::uint8_t node, Instant now) {
  if (records_.keep_operational() && host().manages() && !host().sleeps() &&
      parts_.diagnosis.strayed(node)) {
    parts_.nmt.send_nmt(nmt::Command::start, node, now);
  }
}

diagnosis::RecordHost::Transmission RecordService::transmission() const {
  node::Node& node = parts_.node;
  return {.fd = parts_.load.wants_fast(),
          .waiting = !node.transmit().empty() || !node.pdos().quiet(),
          .overrun = node.transmit().refused() != 0};
}

AbortCode RecordService::may_scan(std::uint8_t node) const {
  if (node == config_.node_id) {
    return AbortCode::invalid_value;
  }
  if (!host().manages()) {
    return AbortCode::local_control;
  }
  return host().usable() && !parts_.scanning.active() ? AbortCode::none : AbortCode::device_state;
}

AbortCode RecordService::may_trigger(std::uint8_t node, std::uint8_t number) const {
  return parts_.orders.may_trigger(node, number);
}

AbortCode RecordService::transmit(const can::Frame& frame) {
  if (uses_identifier(parts_.node, parts_.plan.tpdos, frame)) {
    return AbortCode::local_control;
  }
  return host().usable() && !sleeps() && send_generic(parts_.node, frame) == Error{}
             ? AbortCode::none
             : AbortCode::device_state;
}

// PDOs without a communication record keep the times of the plan.
void RecordService::apply_pdo_times() {
  constexpr std::uint8_t kType = 2;
  constexpr std::uint8_t kInhibit = 3;
  constexpr std::uint8_t kEventTimer = 5;
  od::Dictionary& dictionary = parts_.node.dictionary();
  const auto set = [&dictionary](od::Address address, std::optional<std::uint16_t> time) {
    if (time && dictionary.number(address) != *time) {
      (void)dictionary.set(address, *time);
    }
  };
  const std::uint16_t first = pdo::communication_base(pdo::PdoKind::tpdo);
  for (std::uint16_t index = first; index < first + pdo::kMaxPdo; ++index) {
    const auto type = dictionary.number({index, kType});
    if (type && pdo::is_event_driven(static_cast<std::uint8_t>(*type))) {
      set({index, kInhibit}, settings().inhibit_time);
      set({index, kEventTimer}, settings().event_time);
    }
  }
}

}  // namespace linegate::line
