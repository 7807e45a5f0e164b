// SPDX-License-Identifier: Apache-2.0
#include "stack/line/connection_service.h"

#include <algorithm>
#include <array>
#include <utility>

#include "stack/can/cob_id.h"
#include "stack/line/generic_can.h"

namespace linegate::line {

ConnectionService::ConnectionService(ServiceHost& host, const LineConfig& config, node::Node& node,
                                     std::span<const pdo::LinkedPdo> linked, sdo::Arbiter& sdo,
                                     EventLog& events)
    : Service(host),
      config_(config),
      node_(node),
      linked_(linked),
      connections_({.pool = config.connection_pool, .sdo_timeout = config.sdo_timeout}, sdo, events,
                   *this) {
}

std::span<const CommandKind> ConnectionService::commands() const {
  static constexpr std::array kCommands{CommandKind::connection_open, CommandKind::connection_close,
                                        CommandKind::connection_list};
  return kCommands;
}

void ConnectionService::execute(Command command, Instant now) {
  if (!host().manages()) {
    host().refuse(command, Refusal::wrong_role, now);
    return;
  }
  if (kind(command) == CommandKind::connection_list) {
    host().reply(command.tag, Error{}, connections_.table());
    return;
  }
  Refusal why = Refusal::none;
  if (!host().usable()) {
    why = Refusal::line_down;
  } else if (kind(command) == CommandKind::connection_open) {
    why = open(command, now);
  } else {
    why = close(command, now);
  }
  if (why != Refusal::none) {
    host().refuse(command, why, now);
  }
}

Refusal ConnectionService::open(const Command& command, Instant now) {
  const auto& request = std::get<ConnectionOpen>(command.request);
  const auto is_other_node = [this](std::uint8_t node) {
    return node >= can::kMinNodeId && node <= can::kMaxNodeId && node != config_.node_id;
  };
  if (!is_other_node(request.node) || !is_other_node(request.server) ||
      request.node == request.server) {
    return Refusal::bad_request;
  }
  if (config_.connection_pool.pairs() == 0) {
    return Refusal::wrong_state;
  }
  const std::uint32_t number = connections_.open(
      request.node, request.server, {.timeout = command.timeout, .client = command.client}, now);
  if (number == 0) {
    return Refusal::busy;
  }
  pending_.push_back({.number = number, .tag = command.tag, .opens = true});
  return Refusal::none;
}

Refusal ConnectionService::close(const Command& command, Instant now) {
  const std::uint32_t number = std::get<ConnectionClose>(command.request).number;
  const manager::Connection* const known = connections_.find(number);
  if (known == nullptr) {
    return Refusal::bad_request;
  }
  using State = manager::ConnectionState;
  const bool waits = std::ranges::any_of(
      pending_, [number](const Pending& each) { return each.number == number; });
  if (waits || (known->state != State::open && known->state != State::stale)) {
    return Refusal::wrong_state;
  }
  if (!connections_.close(number, {.timeout = command.timeout, .client = command.client}, now)) {
    return Refusal::busy;
  }
  pending_.push_back({.number = number, .tag = command.tag});
  return Refusal::none;
}

void ConnectionService::ended(std::uint32_t number, AbortCode why, bool expired, Instant /*now*/) {
  const auto it = std::ranges::find(pending_, number, &Pending::number);
  if (it == pending_.end()) {
    return;
  }
  const Pending command = *it;
  pending_.erase(it);
  ReplyData data;
  const manager::Connection* const known = connections_.find(number);
  if (command.opens && !expired && why == AbortCode::none && known != nullptr) {
    data = SdoConnections{*known};
  }
  const Error error = expired                  ? to_error(Refusal::timed_out)
                      : why == AbortCode::none ? Error{}
                                               : to_error(why);
  host().reply(command.tag, error, std::move(data));
}

void ConnectionService::end(Refusal why, Instant now) {
  const std::vector<Pending> ended = std::exchange(pending_, {});
  if (!host().is_running() && host().manages() && host().usable() && !host().sleeps()) {
    ending_ = true;
    connections_.release_all(now);
  } else {
    connections_.abandon(now);
  }
  for (const Pending& command : ended) {
    host().reply(command.tag, to_error(why), {});
  }
}

void ConnectionService::boot_up(std::uint8_t node, Instant now) {
  if (host().manages()) {
    connections_.boot_up(node, now);
  }
}

void ConnectionService::heartbeat_recovered(std::uint8_t node, Instant now) {
  if (host().manages()) {
    connections_.recovered(node, now);
  }
}

bool ConnectionService::uses(std::uint32_t id) {
  return uses_identifier(node_, linked_, can::Frame{.id = id});
}

std::vector<std::uint16_t> ConnectionService::records(std::uint8_t node, std::uint16_t first,
                                                      std::uint16_t last) const {
  std::vector<std::uint16_t> out;
  const auto known = std::ranges::find(config_.nodes, node, &NodeConfig::id);
  if (known == config_.nodes.end()) {
    return out;
  }
  for (const od::ObjectDescription& object : known->device.objects) {
    if (object.index >= first && object.index <= last) {
      out.push_back(object.index);
    }
  }
  return out;
}

}  // namespace linegate::line
