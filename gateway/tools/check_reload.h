// SPDX-License-Identifier: Apache-2.0
// `linegate check NEW --against RUNNING`: describes what a reload would change.
#pragma once

#include <string>

#include "gateway/config/plan_difference.h"

namespace linegate::gateway {

// Describes what a reload would change in a gateway that runs the configuration `running` if it
// became `wanted`. Returns the exit codes of check(), and kExitUsage also if the change needs a
// restart of the gateway.
int check_reload(const std::string& running, const std::string& wanted, bool json);

std::string to_json(const config::PlanDifference& difference);

}  // namespace linegate::gateway
