// SPDX-License-Identifier: Apache-2.0
#include "gateway/publish/access.h"

namespace linegate::gateway {

bool permitted(line::CommandKind kind, config::Access commands, config::Access outputs) {
  switch (kind) {
    case line::CommandKind::sdo_read:
    case line::CommandKind::network_read:
    case line::CommandKind::local_read:
    case line::CommandKind::routing_trace:
    case line::CommandKind::can_listen:
    case line::CommandKind::scan:  // writes nothing
    case line::CommandKind::connection_list:
      return commands != config::Access::off;
    case line::CommandKind::output_write:
    case line::CommandKind::object_write:
    case line::CommandKind::pdo_trigger:
    case line::CommandKind::mpdo_write:
      return commands == config::Access::all && outputs == config::Access::all;
    case line::CommandKind::sdo_write:
    case line::CommandKind::network_write:
    case line::CommandKind::local_write:
    case line::CommandKind::emcy_send:
    case line::CommandKind::nmt:
    case line::CommandKind::boot:
    case line::CommandKind::configure:
    case line::CommandKind::program:
    case line::CommandKind::lss:
    case line::CommandKind::can_send:
    case line::CommandKind::object_create:
    case line::CommandKind::scan_apply:
    case line::CommandKind::pdo_request:
    case line::CommandKind::connection_open:
    case line::CommandKind::connection_close:
    case line::CommandKind::sleep:
      break;
  }
  return commands == config::Access::all;
}

bool permitted(const line::Command& command, config::Access commands, config::Access outputs) {
  const auto* const configure = std::get_if<line::Configure>(&command.request);
  if (configure != nullptr && !configure->apply) {
    return commands != config::Access::off;
  }
  return permitted(line::kind(command), commands, outputs);
}

bool permitted(const request::GatewayRequest& request, config::Access commands) {
  return std::holds_alternative<request::Versions>(request) ||
         std::holds_alternative<request::JournalRead>(request) || commands == config::Access::all;
}

bool permitted(const line::Command& command, ClientRight right) {
  switch (right) {
    case ClientRight::unlimited:
    case ClientRight::engineer:
      return true;
    case ClientRight::none:
      return false;
    case ClientRight::operate:
      break;
  }
  switch (line::kind(command)) {
    case line::CommandKind::output_write:
    case line::CommandKind::object_write:
    case line::CommandKind::pdo_trigger:
    case line::CommandKind::pdo_request:
    case line::CommandKind::mpdo_write:
    case line::CommandKind::nmt:
    case line::CommandKind::boot:
    case line::CommandKind::emcy_send:
    case line::CommandKind::sleep:
      return true;
    default:
      return permitted(command, config::Access::read, config::Access::off);
  }
}

bool permitted(const request::GatewayRequest& request, ClientRight right) {
  if (right == ClientRight::operate)
    return !std::holds_alternative<request::BusFault>(request);
  return right != ClientRight::none;
}

config::LineAccess access_of(const config::LinePlan& plan, const ClientIdentity& client) {
  const bool is_known = !client.subject.empty() && (client.right == ClientRight::operate ||
                                                    client.right == ClientRight::engineer);
  if (is_known && !plan.clients.empty()) {
    const auto found = plan.clients.find(
        (client.right == ClientRight::operate ? "operator/" : "engineer/") + client.subject);
    if (found != plan.clients.end()) {
      return found->second;
    }
  }
  return {plan.commands, plan.outputs};
}

bool is_of_outputs(line::CommandKind kind) {
  return kind == line::CommandKind::output_write || kind == line::CommandKind::pdo_trigger;
}

}  // namespace linegate::gateway
