// SPDX-License-Identifier: Apache-2.0
// Random plants about LSS: devices without a node-ID that appear and disappear, beside devices that
// use the node-IDs to be assigned, in the language of README.md.
#pragma once

#include <string>

namespace linegate::plant {

// The same seed returns the same plant.
std::string generate_lss(unsigned long seed);

}  // namespace linegate::plant
