// SPDX-License-Identifier: Apache-2.0
// What subscribers may do to a line.
#pragma once

#include "gateway/config/plant.h"
#include "stack/line/command.h"

namespace linegate::gateway {

// Versions need no access; `read` permits commands that change nothing. A single output value, an
// object that may be written by PDO, and the trigger of a PDO need `all` of commands and of
// outputs.
bool permitted(line::CommandKind kind, config::Access commands, config::Access outputs);
// The same with the members of the command: to verify configurations needs `read`.
bool permitted(const line::Command& command, config::Access commands, config::Access outputs);

// The command refers to entries, bytes or PDOs by their places in the output layout.
bool is_of_outputs(line::CommandKind kind);

}  // namespace linegate::gateway
