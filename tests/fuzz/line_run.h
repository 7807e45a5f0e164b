// SPDX-License-Identifier: Apache-2.0
// One input of the targets `line` and `line_fd`.
#pragma once

#include "tests/fuzz/input.h"

namespace linegate::fuzz {

// Runs a line with what the input says (line_input.h): a setup and then a sequence of steps,
// everything that can happen to a line in any order. The promises that always hold are in
// line_subject.cpp. Frames of a line of CANopen FD are FD frames, with up to 64 bytes.
void run_line(Input input, bool fd);

}  // namespace linegate::fuzz
