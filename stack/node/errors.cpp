// What the node does about errors of its own communication and of its stored parameters: EMCY,
// error register, 1029h.
#include "stack/node/impl.h"

namespace linegate::node {
namespace {

std::array<std::byte, 2> bytes_of(std::uint16_t number) {
  std::array<std::byte, 2> out{};
  store_le(out.data(), number);
  return out;
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

}  // namespace

void Node::Impl::begin(Fault fault, std::uint16_t number, std::uint16_t code,
                       std::array<std::byte, 2> info) {
  const std::uint8_t present = emcy.error_register();
  const bool first = !faults.any();
  if (faults.begin(fault, number)) {
    if (first) {
      generic_error_before = (present & emcy::kGeneric) != 0;
    }
    emcy.send(code, present | emcy::kGeneric | emcy::kCommunication, info, now);
  }
}

void Node::Impl::end(Fault fault, std::uint16_t number) {
  if (!faults.end(fault, number) || faults.any()) {
    return;
  }
  unsigned gone = emcy::kCommunication;
  if (!generic_error_before) {
    gone |= emcy::kGeneric;
  }
  emcy.send(emcy::kErrorReset, static_cast<std::uint8_t>(emcy.error_register() & ~gone), {}, now);
}

void Node::Impl::obey_error_behaviour(std::uint8_t error_class) {
  if (const auto reaction = error_behaviour.reaction(error_class, slave.state())) {
    command(*reaction, now);
  }
}

// EMCY 6300h (data set), its first manufacturer byte the storage::Damage. The generic error stays
// in 1001h until the next reset of the node.
void Node::Impl::tell_damage(storage::Damage what) {
  const std::byte info[] = {static_cast<std::byte>(what)};
  emcy.send(emcy::kDataSet, emcy.error_register() | emcy::kGeneric, info, now);
  tell_configuration_error({storage::kStoreParameters, 0}, abort_code(what));
}

void Node::Impl::heartbeat_lost(std::uint8_t node, Instant /*deadline*/) {
  begin(Fault::heartbeat, node, emcy::kHeartbeatError, {std::byte{node}, std::byte{0}});
  obey_error_behaviour(nmt::kCommunicationError);
}

void Node::Impl::heartbeat_recovered(std::uint8_t node, Instant /*time*/) {
  end(Fault::heartbeat, node);
}

void Node::Impl::life_guarding_lost(Instant /*deadline*/) {
  begin(Fault::life_guarding, 0, emcy::kHeartbeatError);
  obey_error_behaviour(nmt::kCommunicationError);
}

void Node::Impl::life_guarding_recovered(Instant /*time*/) {
  end(Fault::life_guarding, 0);
}

void Node::Impl::rpdo_received(std::uint16_t number, Instant time) {
  application->rpdo_received(number, time);  // wanted only if there is one
}

void Node::Impl::before_tpdo(std::uint16_t number) {
  if (application != nullptr) {
    application->before_tpdo(number);
  }
}

void Node::Impl::rpdo_wrong_length(std::uint16_t number, unsigned mapped, unsigned received) {
  if (received < mapped) {
    begin(Fault::rpdo_length, number, emcy::kPdoLength, bytes_of(number));
  } else {
    begin(Fault::rpdo_too_long, number, emcy::kPdoTooLong, bytes_of(number));
  }
  if (application != nullptr) {
    application->rpdo_wrong_length(number, mapped, received);
  }
}

void Node::Impl::rpdo_deadline(std::uint16_t number) {
  begin(Fault::rpdo_deadline, number, emcy::kRpdoTimeout, bytes_of(number));
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
  end(Fault::rpdo_deadline, number);
  if (application != nullptr) {
    application->rpdo_in_order(number);
  }
}

void Node::Impl::tell_configuration_error(od::Address place, AbortCode why) {
  Event event{.time = now, .kind = EventKind::configuration_error, .node = options.node_id};
  event.length = 3;
  event.code = static_cast<std::uint32_t>(why);
  store_le(event.data.data(), place.index);
  event.data[2] = std::byte{place.sub};
  events.emit(event);
}

void Node::Impl::pdo_unusable(od::Address place, AbortCode why) {
  tell_configuration_error(place, why);
  if (application != nullptr) {
    application->pdo_unusable(place, why);
  }
}

}  // namespace linegate::node
