// SPDX-License-Identifier: Apache-2.0
// What a device description would be with another node-ID.
#pragma once

#include <cstdint>

#include "stack/od/description.h"

namespace linegate::od {

// Values, limits and defaults that the file gives as $NODEID + a number follow the node-ID
// (1..127).
DeviceDescription with_node_id(DeviceDescription device, std::uint8_t node_id);

}  // namespace linegate::od
