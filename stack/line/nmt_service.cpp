// SPDX-License-Identifier: Apache-2.0
#include "stack/line/nmt_service.h"

#include <array>
#include <utility>

#include "stack/line/command_checks.h"
#include "stack/nmt/node_control.h"

namespace linegate::line {

std::span<const CommandKind> NmtService::commands() const {
  static constexpr std::array kCommands{CommandKind::nmt};
  return kCommands;
}

void NmtService::execute(Command command, Instant now) {
  const auto request = std::get<NmtRequest>(command.request);
  const bool own = request.node == own_node_ || restarts_network(request.command, request.node);
  const Error why = send(request.command, request.node, now, command.client);
  if (why != Error{} || own) {
    host().answer(command, why, {}, now);
    return;
  }
  const can::Frame frame = nmt::encode({request.command, request.node});
  host().answer_when_sent({.command = std::move(command), .frames = {{.frame = frame}}}, now);
}

// Only such a command ends a fatal error.
bool NmtService::restarts_network(nmt::Command command, std::uint8_t node) const {
  return host().manages() && nmt_host_.has_failed() && nmt::is_reset(command) &&
         (node == own_node_ || node == 0);
}

Error NmtService::send(nmt::Command command, std::uint8_t node, Instant now, std::uint32_t client) {
  if (const Error why = check_nmt(command, node); why != Error{}) {
    return why;
  }
  if (host().sleeps()) {
    return to_error(Refusal::wrong_state);
  }
  if (restarts_network(command, node)) {
    node_.command(command, now);
    manager_.boot(0, now, client);
    return {};
  }
  if (node == own_node_) {
    node_.command(command, now);
    if (nmt::is_reset(command)) {
      manager_.own_reset(client);
    }
    return {};
  }
  if (!host().manages()) {
    return to_error(Refusal::wrong_role);
  }
  return send_to_others(command, node, now, client) ? Error{} : to_error(Refusal::busy);
}

bool NmtService::send_to_others(nmt::Command command, std::uint8_t node, Instant now,
                                std::uint32_t client) {
  if (!host().manages() || host().sleeps() || !master_.send(command, node, now)) {
    return false;
  }
  nmt_host_.nmt_sent(command, node, now);
  manager_.commanded(command, node, now, client);
  return true;
}

void NmtService::end(Refusal why, Instant now) {
  host().refuse_unsent(CommandKind::nmt, why, now);
}

void NmtService::answer_unsent(FramesUnderWay::Sending& sending, Instant now) {
  const Command& command = sending.command;
  const auto& request = std::get<NmtRequest>(command.request);
  const bool waits = sending.frames.front().number == 0 && !host().bus_is_stuck(now) &&
                     master_.waits({request.command, request.node});
  host().refuse(command, waits ? Refusal::awaits_turn : Refusal::no_acknowledge, now);
}

}  // namespace linegate::line
