// SPDX-License-Identifier: Apache-2.0
// What is set up at devices that a scan found, so that a manager can use them: error control, and
// the analogue inputs of modules of CiA 401.
#pragma once

#include <span>

#include "stack/base/time.h"
#include "stack/scan/scanned_node.h"

namespace linegate::scan {

// In what was read of them, as if it had been written already; who configures the devices writes
// it. What a device has set up is kept, and what it does not have is not asked of it:
//   1017h = heartbeat (whole ms, 1..65535) where it is 0 and the node is not guarded;
//   without 1017h, 100Ch = heartbeat and 100Dh = 4 where one of them is 0;
//   6423h = 1: analogue inputs are sent when they change.
void set_up(std::span<ScannedNode> nodes, Duration heartbeat);

}  // namespace linegate::scan
