// SPDX-License-Identifier: Apache-2.0
// Random plants about LSS: devices without a node-ID that come and go, beside devices that use the
// node-ID they are to be given, in the language of README.md.
#pragma once

#include <string>

namespace linegate::plant {

// The same seed gives the same plant.
std::string generate_lss(unsigned long seed);

}  // namespace linegate::plant
