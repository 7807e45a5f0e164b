// SPDX-License-Identifier: Apache-2.0
// Random plants as scenario text: what fails can be read, kept and run again.
#pragma once

#include <string>

namespace linegate::plant {

// A network of 1 to 12 devices with deaths, returns, cut cables, commands (NMT, too), output
// writes, MPDOs, strangers' frames and losses. The same seed gives the same text. It ends with
// expectations that must hold once the network is left alone: living nodes Operational, dead ones
// missing; NMT commands are followed, MPDOs bring their values, and who is guarded no more says so.
std::string generate(unsigned long seed);

// The shortest scenario that still fails, by leaving out statements one at a time. Precondition:
// the text fails with this seed.
std::string shrink(const std::string& text, unsigned long seed);

}  // namespace linegate::plant
