// SPDX-License-Identifier: Apache-2.0
// Error output as JSON for commands that work on files and report errors on standard error.
#pragma once

#include <functional>

namespace linegate::gateway {

// Runs the action, which returns the exit code. With json, wrong usage and a failure without any
// result are printed as objects on standard output, too.
int with_problems_as_json(bool json, const std::function<int()>& action);

}  // namespace linegate::gateway
