// SPDX-License-Identifier: Apache-2.0
// What must hold in every world at any time, whatever happened in it.
#pragma once

#include <string>

#include "tests/plant/world.h"

namespace linegate::plant {

// A sentence about the first rule that does not hold; nothing if all do.
//   events are numbered 1, 2, 3, ... without gaps
//   every valid input entry holds what the last frame of its PDO carried
//   counters add up: frames the line sent and received are frames that were on the bus
//   no command got two replies
//   the observer of the line has sent nothing, has the same layouts, and numbers its events as well
//   a line of our devices below numbers its events as well
//   nodes of ours send no error reset while an error remains
//   a guarded device told that its life guarding was lost exactly when no request came in time
//   2F01h and 2F02h of a device with MPDOs are what MPDOs brought
//   what is shown of a node is what was received of it, see state_model.h; a node that an observer
//   does not show as present shows no state
//   a node-ID that one device has is not reported as that of two, see identity_model.h
//   a line transmits only what it is configured for, and no NMT command unless it is NMT master; it
//   writes no valid COB-ID that is restricted, see silence_model.h
//   what is answered as done was done, see answer_model.h, and own_answer_model.h of our devices
//   a long value that was read by SDO is one that was written, and whole
std::string check_always(LineSeat& seat, Instant now);

// Besides, when nothing has been asked or disturbed for some seconds: every command was answered,
// and a node whose error control is monitored is in the state that the line says.
std::string check_settled(LineSeat& seat, std::uint64_t commands);

}  // namespace linegate::plant
