// SPDX-License-Identifier: Apache-2.0
// What subscribers may do to a line.
#pragma once

#include "gateway/config/plant.h"
#include "stack/line/command.h"

namespace linegate::gateway {

// Versions are told to everybody; read allows what changes nothing; a single output value, an
// object that may go by PDO and the trigger of a PDO need both: commands and outputs.
bool permitted(line::CommandKind kind, config::Access commands, config::Access outputs);
// The same with what the command is about: to verify configurations reads alone.
bool permitted(const line::Command& command, config::Access commands, config::Access outputs);

// It means entries, bytes or PDOs of the line's outputs by their places: of one layout.
bool is_of_outputs(line::CommandKind kind);

}  // namespace linegate::gateway
