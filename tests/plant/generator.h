// SPDX-License-Identifier: Apache-2.0
// Random plants as scenario text, so that a failing one can be read, kept and repeated.
#pragma once

#include <string>

namespace linegate::plant {

// A network of 1 to 12 devices that are switched off and on and disconnected, with commands (also
// NMT), output writes, MPDOs, foreign frames and losses. The same seed returns the same text. The
// expectations at its end must hold once the network is not disturbed any more: devices that are on
// are Operational, devices that are off are missing; NMT commands are executed, MPDOs transfer
// their values, and devices without guarding requests report it.
std::string generate(unsigned long seed);

// The shortest scenario that still fails, found by removing one statement at a time. Precondition:
// the text fails with this seed.
std::string shrink(const std::string& text, unsigned long seed);

}  // namespace linegate::plant
