// SPDX-License-Identifier: Apache-2.0
// What was wrong with a command that was refused, and what there is instead: as far as the line
// tells of itself.
#pragma once

#include <string>

#include "bridges/console/commands.h"
#include "bridges/console/model.h"
#include "stack/line/command.h"

namespace linegate::console {

// "node 99 is none of press; its nodes: 5 (ram), 8". Empty if it is one.
std::string no_such_node(const Line& line, std::uint8_t node);

// The same on context.err, behind what the gateway says of a node that the line knows nothing of;
// waits for what the line tells of its nodes. Nothing if node is 0 or the line does not tell.
void tell_no_such_node(Context& context, Model& model, const Line& line, std::uint8_t node);

// Refusal::wrong_state of a single value for an output of that node: answer.text names the node and
// its state, too.
void add_node_state(Context& context, Model& model, const Line& line, std::uint8_t node,
                    Client::Answer& answer);

// Of a CommandKind::pdo_trigger, behind the words of the refusal. Empty if there is no more to say.
std::string trigger_refusal(Context& context, Model& model, const Line& line,
                            const line::Command& command, line::Refusal refusal);

}  // namespace linegate::console
