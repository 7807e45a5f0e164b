// SPDX-License-Identifier: Apache-2.0
// Describes a device without a device file, from the values that a scan read, as an
// od::DeviceDescription.
//
// Objects have the names and types of CiA 301 where it defines them. Of mapped objects only the
// length is known: such an object is BOOLEAN for 1 bit and UNSIGNEDn otherwise, or OCTET_STRING if
// CiA 301 has no type of that length; read-only if it is sent, rww if it is received. The values of
// the device become the defaults, so a manager that boots the device with this description writes
// nothing.
#pragma once

#include <span>

#include "stack/base/time.h"
#include "stack/od/description.h"
#include "stack/scan/scanned_node.h"

namespace linegate::scan {

od::DeviceDescription describe(const ScannedNode& node);

// --- with the device's own EDS ------------------------------------------------------------------

// Whether vendor-ID and product code (1018h:1, 2) and the major revision number (1018h:3, upper
// half) are those of the file. Numbers that are 0 in the file are not compared, except the
// vendor-ID: 0, as in house-made devices, matches if the device also has 0 and the file has a
// product code.
bool matches(const od::DeviceDescription& file, const ScannedNode& node);

// The file with the values that a scan read from the device. file: resolved with the node's
// node-ID. Values that differ from its defaults become configured values (DCF ParameterValue);
// objects of the device that the file lacks are added by describe().
od::DeviceDescription merge(od::DeviceDescription file, const ScannedNode& node);

// Sets up devices that a scan found, so that a manager can use them: error control, and the
// analogue inputs of CiA 401 modules. Changes the scanned values as if they had been written
// already; the manager writes them when it configures the devices. Existing settings of a device
// are kept, and objects that it lacks are not added:
//   1017h = heartbeat (whole ms, 1..65535) where it is 0 and the node is not guarded;
//   without 1017h, 100Ch = heartbeat and 100Dh = 4 where one of them is 0;
//   6423h = 1: analogue inputs are sent when they change.
void set_up(std::span<ScannedNode> nodes, Duration heartbeat);

}  // namespace linegate::scan
