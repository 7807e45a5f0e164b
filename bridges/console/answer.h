// SPDX-License-Identifier: Apache-2.0
// Asking a line, and saying what it answered: the same for all commands that are one question.
#pragma once

#include <cstdint>
#include <string>

#include "bridges/console/client.h"
#include "bridges/console/commands.h"
#include "bridges/console/lookup.h"
#include "bridges/console/model.h"

namespace linegate::console {

// Waits for the answer, for context.timeout at most; where the gateway has that time limit, too,
// somewhat longer. layout_id: see Client::call().
Client::Answer ask_line(Context& context, Model& model, const Line& line,
                        const line::Command& command, std::uint64_t layout_id = 0);

// Prints the answer as JSON if that is wanted, else its value, if there is one, or what was wrong.
// kDone, kFailed, or kHeldBack if the bus did not acknowledge the frame.
int print_answer(Context& context, const Client::Answer& answer, const std::string& value = {});

// work(Model&, const Line&) with the line that is meant, and gives what it gives; kFailed if there
// is none, which has been told.
template <class Work>
int on_line(Context& context, const std::string& name, const Work& work) {
  Model model;
  const Line* const line = find_line(context, model, name);
  return line == nullptr ? kFailed : work(model, *line);
}

}  // namespace linegate::console
