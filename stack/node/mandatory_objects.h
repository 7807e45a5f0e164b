// SPDX-License-Identifier: Apache-2.0
// The objects that a node of this stack always has.
#pragma once

#include <cstdint>

#include "stack/od/dictionary.h"

namespace linegate::node {

// Adds those of 1000h (device type 0), 1001h, 1014h (80h + node-ID), 1017h (0) and 1018h (all 0)
// that are missing: mandatory by CiA 301, 1014h and 1017h because the node serves EMCY and
// heartbeat. What is there stays as it is.
void add_mandatory_objects(od::Dictionary& dictionary, std::uint8_t node_id);

}  // namespace linegate::node
