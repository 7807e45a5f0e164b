// SPDX-License-Identifier: Apache-2.0
// Reactions of the node to errors of its communication and of its stored parameters: EMCY, error
// register, 1029h.
#include <algorithm>
#include <utility>

#include "stack/node/impl.h"
#include "stack/od/objects.h"

namespace linegate::node {
namespace {

// Bits of ErrorScheme::temporary_and_sticky.
enum Temporary : std::uint8_t { kErrorControl = 0x01, kPassive = 0x02, kBusOff = 0x04 };
enum Sticky : std::uint8_t { kController = 0x01, kOverrun = 0x02, kPdoLength = 0x04 };
constexpr std::uint8_t kOfTheDevice = 0xE0;  // bits of the device, in both bytes

std::uint8_t sticky_bit(Fault fault) {
  switch (fault) {
    case Fault::passive:
    case Fault::bus_off:
      return kController;
    case Fault::overrun:
      return kOverrun;
    case Fault::rpdo_length:
    case Fault::rpdo_too_long:
      return kPdoLength;
    default:
      return 0;
  }
}

AbortCode abort_code(storage::Damage damage) {
  switch (damage) {
    case storage::Damage::none:
      break;
    case storage::Damage::unreadable:
      return AbortCode::hardware;
    case storage::Damage::damaged:
      return AbortCode::crc;
    case storage::Damage::version:
    case storage::Damage::owner:
      return AbortCode::device_incompatible;
    case storage::Damage::unusable:
      return AbortCode::parameter_incompatible;
  }
  return AbortCode::none;
}
constexpr Duration kBetweenOverruns = std::chrono::seconds(1);

}  // namespace

void Node::Impl::begin(Fault fault, std::uint16_t number, Lengths lengths) {
  if (!faults.begin(fault, number)) {
    return;
  }
  sticky |= sticky_bit(fault);
  const std::uint16_t code = emergency_code(fault);
  const std::uint8_t present = errors.begin(code, emcy.error_register());
  send_by_itself(code, present, manufacturer_bytes(number, lengths));
}

bool Node::Impl::wants_error_reset(std::uint16_t code, std::uint8_t& left) {
  left = errors.end(code, emcy.error_register());
  const bool each = options.error_scheme == ErrorScheme::temporary_and_sticky;
  if (!errors.error_free() && !each) {
    emcy.set_error_register(left);
    return false;
  }
  return true;
}

// An error of this class that the node detected has ended. Only ErrorScheme::temporary_and_sticky
// has manufacturer bytes in an error reset.
void Node::Impl::end_error(std::uint16_t code, std::uint16_t number) {
  std::uint8_t left = 0;
  if (wants_error_reset(code, left)) {
    const bool bits = options.error_scheme == ErrorScheme::temporary_and_sticky;
    send_by_itself(emcy::kErrorReset, left,
                   bits ? manufacturer_bytes(number, {}) : emcy::ManufacturerInfo{});
  }
}

void Node::Impl::send_by_itself(std::uint16_t code, std::uint8_t error_register,
                                emcy::ManufacturerInfo info) {
  if (application == nullptr || application->may_send_emcy(code, info)) {
    emcy.send(code, error_register, info, now);
  } else {
    emcy.set_error_register(error_register);
  }
}

void Node::Impl::set_error_bits(std::uint8_t temporary, std::uint8_t added) {
  device_temporary = static_cast<std::uint8_t>(temporary & kOfTheDevice);
  sticky = static_cast<std::uint8_t>(sticky | (added & kOfTheDevice));
}

emcy::ManufacturerInfo Node::Impl::manufacturer_bytes(std::uint16_t number, Lengths lengths) const {
  emcy::ManufacturerInfo info{};
  if (options.error_scheme == ErrorScheme::number) {
    store_le(info.data(), number);
    return info;
  }
  unsigned temporary = device_temporary;
  if (faults.any(Fault::heartbeat) || faults.any(Fault::life_guarding)) {
    temporary |= kErrorControl;
  }
  if (faults.any(Fault::passive)) {
    temporary |= kPassive;
  }
  if (faults.any(Fault::bus_off)) {
    temporary |= kBusOff;
  }
  info[0] = static_cast<std::byte>(temporary);
  info[1] = std::byte{sticky};
  info[2] = static_cast<std::byte>(number);
  info[3] = std::byte{lengths.received};
  info[4] = std::byte{lengths.mapped};
  return info;
}

emcy::SendResult Node::Impl::set_error(std::uint16_t code, std::span<const std::byte> info) {
  ++device_errors[code >> 8U];
  return emcy.send(code, errors.begin(code, emcy.error_register()), info, now);
}

bool Node::Impl::reset_error(std::uint16_t code, std::span<const std::byte> info) {
  std::uint16_t& count = device_errors[code >> 8U];
  if (count == 0) {
    return false;
  }
  --count;
  std::uint8_t left = 0;
  if (wants_error_reset(code, left)) {
    const bool bits = options.error_scheme == ErrorScheme::temporary_and_sticky;
    const emcy::ManufacturerInfo own = manufacturer_bytes(0, {});
    emcy.send(emcy::kErrorReset, left,
              bits && info.empty() ? std::span<const std::byte>(own) : info, now);
  }
  return true;
}

emcy::SendResult Node::Impl::report_error(std::uint16_t code, std::uint8_t bits,
                                          std::span<const std::byte> info) {
  if (code >> 8U == 0) {
    return send_error_reset(end_all_reported(), info);
  }
  bits = static_cast<std::uint8_t>(bits | emcy::register_of(code));
  std::uint8_t present = emcy.error_register();
  const auto end = reported.begin() + static_cast<std::ptrdiff_t>(reported_count);
  const auto known = std::find_if(reported.begin(), end,
                                  [code](const Reported& error) { return error.code == code; });
  if (known != end) {
    present = errors.end_bits(known->bits, present);
  } else if (reported_count == reported.size()) {
    return emcy::SendResult::inhibited;
  } else {
    ++reported_count;
  }
  *known = {code, bits};
  return emcy.send(code, errors.begin_bits(bits, present), info, now);
}

std::uint8_t Node::Impl::end_all_reported() {
  std::uint8_t left = emcy.error_register();
  for (; reported_count > 0; --reported_count) {
    left = errors.end_bits(reported[reported_count - 1].bits, left);
  }
  return left;
}

void Node::Impl::end_reported(std::uint16_t code) {
  const auto end = reported.begin() + static_cast<std::ptrdiff_t>(reported_count);
  const auto known = std::find_if(reported.begin(), end,
                                  [code](const Reported& error) { return error.code == code; });
  if (known == end) {
    return;
  }
  const std::uint8_t left = errors.end_bits(known->bits, emcy.error_register());
  *known = reported[--reported_count];
  (void)send_error_reset(left, {});
}

emcy::SendResult Node::Impl::send_error_reset(std::uint8_t left, std::span<const std::byte> info) {
  const bool each = options.error_scheme == ErrorScheme::temporary_and_sticky;
  if (!errors.error_free() && !each) {
    emcy.set_error_register(left);
    return emcy::SendResult::errors_remain;
  }
  const emcy::ManufacturerInfo own = manufacturer_bytes(0, {});
  return emcy.send(emcy::kErrorReset, left,
                   each && info.empty() ? std::span<const std::byte>(own) : info, now);
}

void Node::Impl::bus_event(const can::BusEvent& event) {
  now = event.time;
  if (event.kind == can::BusEvent::Kind::state) {
    bus_state(event.state);
  } else if (event.kind == can::BusEvent::Kind::frames_lost && now >= next_overrun) {
    next_overrun = now + kBetweenOverruns;
    begin(Fault::overrun, 0);
    end(Fault::overrun, 0);
  }
}

// The EMCY for bus-off follows its end, as nothing can be sent before.
void Node::Impl::bus_state(can::BusState state) {
  const can::BusState before = std::exchange(bus, state);
  if (before == state) {
    return;
  }
  if (before == can::BusState::bus_off) {
    begin(Fault::bus_off, 0);
    end(Fault::bus_off, 0);
  }
  if (state == can::BusState::error_passive) {
    begin(Fault::passive, 0);
  } else if (state == can::BusState::error_active || state == can::BusState::error_warning) {
    end(Fault::passive, 0);
  } else if (state == can::BusState::bus_off) {
    sticky |= kController;
    obey_error_behaviour(nmt::kCommunicationError);
  }
}

Indicators Node::Impl::indicators() const {
  return indicate(
      {.state = slave.state(),
       .bus = bus,
       .event_timer_error = faults.any(Fault::rpdo_deadline),
       .sync_error = sync.lost(),
       .error_control_event = faults.any(Fault::heartbeat) || faults.any(Fault::life_guarding),
       .invalid_configuration = started && pdos.any_unusable()});
}

void Node::Impl::obey_error_behaviour(std::uint8_t error_class) {
  if (const auto reaction = error_behaviour.reaction(error_class, slave.state())) {
    command(*reaction, now);
  }
}

// Sends EMCY 6300h (data set) with storage::Damage in the first manufacturer byte. The error is
// present until the next reset of the node: no error reset is sent before.
void Node::Impl::report_damage(storage::Damage what) {
  send_by_itself(emcy::kDataSet, errors.begin(emcy::kDataSet, emcy.error_register()),
                 {static_cast<std::byte>(what)});
  report_configuration_error({od::objects::kStoreParameters, 0}, abort_code(what));
}

void Node::Impl::heartbeat_lost(std::uint8_t node, Instant deadline) {
  begin(Fault::heartbeat, node);
  if (master_services != nullptr) {
    master_services->consumer_lost(node, deadline);
  }
  obey_error_behaviour(nmt::kCommunicationError);
}

void Node::Impl::heartbeat_recovered(std::uint8_t node, Instant /*time*/) {
  end(Fault::heartbeat, node);
}

void Node::Impl::life_guarding_lost(Instant /*deadline*/) {
  begin(Fault::life_guarding, 0);
  obey_error_behaviour(nmt::kCommunicationError);
}

void Node::Impl::life_guarding_recovered(Instant /*time*/) {
  end(Fault::life_guarding, 0);
}

void Node::Impl::rpdo_received(std::uint16_t number, Instant time) {
  application->rpdo_received(number, time);  // called only if there is an application
}

void Node::Impl::before_tpdo(std::uint16_t number) {
  if (application != nullptr) {
    application->before_tpdo(number);
  }
}

void Node::Impl::tpdo_transmitted(std::uint16_t number, std::span<const std::byte> differs) {
  if (application != nullptr) {
    application->tpdo_transmitted(number, differs);
  }
  if (master_services != nullptr) {
    master_services->tpdo_transmitted(number, differs);
  }
}

void Node::Impl::mpdo_transmitted(od::Address source) {
  if (application != nullptr) {
    application->mpdo_transmitted(source);
  }
  if (master_services != nullptr) {
    master_services->mpdo_transmitted(source);
  }
}

void Node::Impl::rpdo_wrong_length(std::uint16_t number, unsigned mapped, unsigned received) {
  const Lengths lengths{static_cast<std::uint8_t>(received), static_cast<std::uint8_t>(mapped)};
  if (received < mapped) {
    begin(Fault::rpdo_length, number, lengths);
  } else {
    begin(Fault::rpdo_too_long, number, lengths);
  }
  if (application != nullptr) {
    application->rpdo_wrong_length(number, mapped, received);
  }
}

void Node::Impl::rpdo_deadline(std::uint16_t number) {
  begin(Fault::rpdo_deadline, number);
  if (application != nullptr) {
    application->rpdo_deadline(number);
  }
}

void Node::Impl::rpdo_recovered(std::uint16_t number) {
  end(Fault::rpdo_deadline, number);
  if (application != nullptr) {
    application->rpdo_recovered(number);
  }
}

void Node::Impl::rpdo_in_order(std::uint16_t number) {
  end(Fault::rpdo_length, number);
  end(Fault::rpdo_too_long, number);
  end(Fault::mpdo, number);
  end(Fault::rpdo_deadline, number);
  if (application != nullptr) {
    application->rpdo_in_order(number);
  }
}

void Node::Impl::report_configuration_error(od::Address place, AbortCode why) {
  events.emit(
      {.time = now,
       .node = options.node_id,
       .data = event::ConfigurationError{.abort = why, .index = place.index, .sub = place.sub}});
}

void Node::Impl::mpdo_received(std::uint16_t number, od::Address place, Instant time) {
  end(Fault::mpdo, number);
  if (application != nullptr) {
    application->mpdo_received(number, place, time);
  }
}

void Node::Impl::mpdo_refused(std::uint16_t number, pdo::MpdoMode mode, od::Address place,
                              AbortCode why) {
  if (mode == pdo::MpdoMode::destination) {
    begin(Fault::mpdo, number);
  }
  if (application != nullptr) {
    application->mpdo_refused(number, mode, place, why);
  }
}

void Node::Impl::mpdo_malformed(const can::Frame& frame) {
  malformed(frame, 0);
  if (application != nullptr) {
    application->mpdo_malformed(frame);
  }
}

void Node::Impl::pdo_unusable(od::Address place, AbortCode why) {
  report_configuration_error(place, why);
  if (application != nullptr) {
    application->pdo_unusable(place, why);
  }
}

}  // namespace linegate::node
