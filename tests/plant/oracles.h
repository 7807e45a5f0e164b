// SPDX-License-Identifier: Apache-2.0
// The conditions that must hold in every world at any time.
#pragma once

#include <string>

#include "tests/plant/world.h"

namespace linegate::plant {

// A description of the first rule that does not hold; empty if all rules hold.
//   events are numbered 1, 2, 3, ... without gaps
//   every valid input entry has the content of the last frame of its PDO
//   counters add up: the frames that the line counted as sent and received were on the bus
//   no command got two replies
//   the observer of the line has sent nothing and has the same layouts
//   the events of the observer, and of a line with own devices, are numbered in the same way
//   own nodes send no error reset while an error remains
//   a guarded device reported the loss of life guarding exactly when no request came in time
//   2F01h and 2F02h of a device with MPDOs have the values that MPDOs transferred
//   the reported state of a node follows from the received frames, see state_model.h; a node that
//   an observer does not show as present shows no state
//   a node-ID of one device is not reported as shared by two, see identity_model.h
//   a line transmits only what is configured, and no NMT command unless it is NMT master; it writes
//   no valid COB-ID that is restricted, see silence_model.h
//   a command that was answered as done was executed, see answer_model.h, and own_answer_model.h
//   for own devices
//   a long value that was read by SDO is a complete value that was written
std::string check_always(LineSeat& seat, Instant now);

// Additional rules when there was no command and no disturbance for some seconds: every command was
// answered, and a node whose error control is monitored is in the reported state; outputs of own
// devices are valid, see own_answer_model.h.
std::string check_settled(LineSeat& seat, std::uint64_t commands, Instant now);

}  // namespace linegate::plant
