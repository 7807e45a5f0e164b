// SPDX-License-Identifier: Apache-2.0
// Checks the access of subscribers to a line.
#pragma once

#include "bridges/request/request.h"
#include "gateway/config/plant.h"
#include "gateway/publish/data_edge.h"
#include "stack/line/command.h"

namespace linegate::gateway {

// `read` permits commands that change nothing. A single output value, an object that may be written
// by PDO, and the trigger of a PDO need `all` for commands and for outputs.
bool permitted(line::CommandKind kind, config::Access commands, config::Access outputs);
// The same for a command with its members: the verification of configurations needs only `read`.
bool permitted(const line::Command& command, config::Access commands, config::Access outputs);
// request::Versions and request::JournalRead need no access, other requests of this kind need
// `all`: the topic Event has the events of each line, whatever its access is.
bool permitted(const request::GatewayRequest& request, config::Access commands);

// Whether a client with that right may send the command: an operator reads, and changes the process
// state; only an engineer changes configuration, firmware and node-IDs.
bool permitted(const line::Command& command, ClientRight right);
bool permitted(const request::GatewayRequest& request, ClientRight right);

// The access of a client to a line: that of its certificate, or else that of the line.
config::LineAccess access_of(const config::LinePlan& plan, const ClientIdentity& client);

// Whether the command refers to entries, bytes or PDOs by their positions in the output layout.
bool is_of_outputs(line::CommandKind kind);

}  // namespace linegate::gateway
