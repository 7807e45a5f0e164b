// SPDX-License-Identifier: Apache-2.0
// One input of the targets `observer` and `observer_fd`.
#pragma once

#include "tests/fuzz/input.h"

namespace linegate::fuzz {

// Runs a line in the role observer. Promises: whatever is on the bus, it sends nothing, and its
// image is consistent. The input is a sequence of steps: one byte each, followed by its arguments.
// On a line of CANopen FD the frames are FD frames, and the transfers are USDO.
void run_observer(Input input, bool fd);

}  // namespace linegate::fuzz
