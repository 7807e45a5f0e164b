// SPDX-License-Identifier: Apache-2.0
// The result of a boot process for subscribers: properties of NodeState.
#pragma once

#include <vector>

#include "gateway/publish/values.h"
#include "stack/line/state.h"

namespace linegate::gateway {

// boot-letter, boot-text, boot-object, boot-abort, boot-expected, boot-found: idl/README.md. Empty
// if the node is booted or its boot process has not ended.
std::vector<Property> boot_properties(const line::NodeState& state);

}  // namespace linegate::gateway
