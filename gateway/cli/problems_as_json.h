// SPDX-License-Identifier: Apache-2.0
// Commands that work on files, and print what is wrong on standard error.
#pragma once

#include <functional>

namespace linegate::gateway {

// Runs the action, which gives the exit code. With json, wrong usage and a failure without any
// result become objects on standard output, too.
int with_problems_as_json(bool json, const std::function<int()>& action);

}  // namespace linegate::gateway
