// SPDX-License-Identifier: Apache-2.0
// The own node of a line, as a device that `linegate decode` explains.
#pragma once

#include "stack/line/config.h"
#include "stack/od/description.h"

namespace linegate::console {

// The objects and PDOs that a configuration adds to the own node (`own_objects`, `own_pdos`,
// `shared_objects` of plant.yaml), without those that are linked to devices. Empty: there are none.
od::DeviceDescription describe_own_node(const line::LineConfig& line);

}  // namespace linegate::console
