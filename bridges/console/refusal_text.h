// SPDX-License-Identifier: Apache-2.0
// Explains the refusal of a command, with valid alternatives where the line publishes them.
#pragma once

#include <string>

#include "bridges/console/commands.h"
#include "bridges/console/model.h"
#include "stack/line/command.h"

namespace linegate::console {

// "node 99 is none of press; its nodes: 5 (ram), 8". Empty if the node belongs to the line.
std::string no_such_node(const Line& line, std::uint8_t node);

// Prints the same on context.err after the gateway's answer; waits for the states of the line's
// nodes. Prints nothing if node is 0 or the line publishes no nodes.
void report_no_such_node(Context& context, Model& model, const Line& line, std::uint8_t node);

// After Refusal::wrong_state for a single output value of that node: adds the node and its state to
// answer.text, unless the reply names a group of outputs whose watchdog has fired.
void add_node_state(Context& context, Model& model, const Line& line, std::uint8_t node,
                    Client::Answer& answer);

// Explains a refused CommandKind::pdo_trigger. Empty if there is nothing to add.
std::string trigger_refusal(Context& context, Model& model, const Line& line,
                            const line::PdoTrigger& trigger, line::Refusal refusal);

}  // namespace linegate::console
