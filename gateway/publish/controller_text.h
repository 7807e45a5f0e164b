// SPDX-License-Identifier: Apache-2.0
// Reports the settings of the CAN controller of a line.
#pragma once

#include <string>
#include <vector>

#include "bridges/can/controller_setup.h"
#include "gateway/config/plant.h"
#include "gateway/publish/values.h"

namespace linegate::gateway {

// One sentence for the log for each setting of the controller that differs from what the line
// needs.
std::vector<std::string> complaints(const config::LinePlan& plan,
                                    const can_bridge::ControllerSetup& controller);

// Appends the known settings as properties of LineState: listen-only, restart-ms.
void add_properties(const can_bridge::ControllerSetup& controller, std::vector<Property>& out);

}  // namespace linegate::gateway
