// SPDX-License-Identifier: Apache-2.0
// What a reload would do, said beforehand: `linegate check NEW --against RUNNING`.
#pragma once

#include <string>

#include "gateway/config/plan_difference.h"

namespace linegate::gateway {

// What a reload would do to a gateway that runs the configuration `running` if that became
// `wanted`. The same exit codes; kExitUsage, too, if only a new start would do it.
int check_reload(const std::string& running, const std::string& wanted, bool json);

std::string to_json(const config::PlanDifference& difference);

}  // namespace linegate::gateway
