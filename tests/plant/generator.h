// SPDX-License-Identifier: Apache-2.0
// Random plants as scenario text, so that a failing one can be read, kept and repeated.
#pragma once

#include <string>

namespace linegate::plant {

// From this seed on plants have a line of CANopen FD.
inline constexpr unsigned long kFirstFdSeed = 1'301'000'000;
inline constexpr unsigned long kFdSeeds = 1'000'000;

// A network of 1 to 12 devices that are switched off and on and disconnected, with commands (also
// NMT), output writes, MPDOs, foreign frames and losses. The same seed returns the same text. The
// expectations at its end must hold once the network is not disturbed any more: devices that are on
// are Operational, devices that are off are missing; NMT commands are executed, MPDOs transfer
// their values, and devices without guarding requests report it. A plant with a line of CANopen FD
// has USDO in place of SDO, PDOs of 64 bytes, and foreign USDO clients, but no guarding, remote
// frames, MPDOs and change of role.
std::string generate(unsigned long seed);

// The shortest scenario that still fails, found by removing one statement at a time. Precondition:
// the text fails with this seed.
std::string shrink(const std::string& text, unsigned long seed);

}  // namespace linegate::plant
