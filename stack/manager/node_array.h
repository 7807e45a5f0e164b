// SPDX-License-Identifier: Apache-2.0
// An object of the manager's dictionary with a value for each node, as most of CiA 302 are.
#pragma once

#include <cstdint>

#include "stack/can/cob_id.h"
#include "stack/od/description.h"

namespace linegate::manager {

inline constexpr std::uint8_t kAllNodes = 128;  // sub-index of requests

// Sub-index 0 and 1..last, by node-ID; kAllNodes stands for all. All values are 0. Precondition:
// the catalogue (od/objects.h) has the index.
od::ObjectDescription node_array(std::uint16_t index, od::Access access,
                                 std::uint8_t last = can::kMaxNodeId);

}  // namespace linegate::manager
