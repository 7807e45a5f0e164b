// SPDX-License-Identifier: Apache-2.0
// What is worth saying of the controller of a line.
#pragma once

#include <string>
#include <vector>

#include "bridges/can/controller_setup.h"
#include "gateway/config/plant.h"
#include "gateway/publish/values.h"

namespace linegate::gateway {

// Where the controller is set to something else than the line needs: a sentence each, for the log.
std::vector<std::string> complaints(const config::LinePlan& plan,
                                    const can_bridge::ControllerSetup& controller);

// LineState's properties of it, as far as they are known: listen-only, restart-ms.
void add_properties(const can_bridge::ControllerSetup& controller, std::vector<Property>& out);

}  // namespace linegate::gateway
