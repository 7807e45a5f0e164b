// SPDX-License-Identifier: Apache-2.0
// A device file for a device that came without one: what a scan read, as an od::DeviceDescription.
//
// Objects have CiA's names and types where CiA 301 gives them. What PDOs map is known by its length
// alone: such an object is BOOLEAN for 1 bit and UNSIGNEDn otherwise, or OCTET_STRING where CiA has
// no type of that length, read-only when it is sent and rww when it is received. Values are those
// that the device has, as defaults: a manager that boots the device with this has nothing to write.
#pragma once

#include <span>

#include "stack/base/time.h"
#include "stack/od/description.h"
#include "stack/scan/scanned_node.h"

namespace linegate::scan {

od::DeviceDescription describe(const ScannedNode& node);

// --- with the device's own EDS ------------------------------------------------------------------

// Vendor-ID and product code (1018h:1, 2) are those of the file, and so is the major revision
// number (1018h:3, upper half); numbers that the file leaves 0 are not compared. Vendor-ID 0, as
// house-made devices have it, is that of the file if the device has it too, and the file a product
// code.
bool matches(const od::DeviceDescription& file, const ScannedNode& node);

// The file with the values that a scan read of the device. file: resolved with the node's node-ID.
// What differs from its defaults becomes a configured value
// (DCF ParameterValue); objects of the device that the file does not have come from describe().
od::DeviceDescription merge(od::DeviceDescription file, const ScannedNode& node);

// What is set up at devices that a scan found, so that a manager can use them: error control, and
// the analogue inputs of modules of CiA 401. In what was read of them, as if it had been written
// already; who configures the devices writes it. What a device has set up is kept, and what it does
// not have is not asked of it:
//   1017h = heartbeat (whole ms, 1..65535) where it is 0 and the node is not guarded;
//   without 1017h, 100Ch = heartbeat and 100Dh = 4 where one of them is 0;
//   6423h = 1: analogue inputs are sent when they change.
void set_up(std::span<ScannedNode> nodes, Duration heartbeat);

}  // namespace linegate::scan
