// SPDX-License-Identifier: Apache-2.0
// Sends a request to a line or its gateway and prints the answer: shared by all commands that are
// one request.
#pragma once

#include <cstdint>
#include <string>

#include "bridges/console/client.h"
#include "bridges/console/commands.h"
#include "bridges/console/lookup.h"
#include "bridges/console/model.h"

namespace linegate::console {

// Waits for the answer, at most context.timeout, and somewhat longer where the gateway has the same
// time limit. layout_id: see Client::call().
Client::Answer ask_line(Context& context, Model& model, const Line& line,
                        const line::Command& command, std::uint64_t layout_id = 0);

// The same for a request that the gateway executes itself.
Client::Answer ask_gateway(Context& context, Model& model, const Line& line,
                           const request::GatewayRequest& request);

// Prints the answer as JSON if requested, else its value or the error. Returns kDone, kFailed, or
// kHeldBack if the bus did not acknowledge the frame.
int print_answer(Context& context, const Client::Answer& answer, const std::string& value = {});

// Calls work(Model&, const Line&) with the named line and returns its result; kFailed, after an
// error message, if there is no such line.
template <class Work>
int on_line(Context& context, const std::string& name, const Work& work) {
  Model model;
  const Line* const line = find_line(context, model, name);
  return line == nullptr ? kFailed : work(model, *line);
}

}  // namespace linegate::console
