// SPDX-License-Identifier: Apache-2.0
// The device's own EDS, with the values that a scan read of the device.
#pragma once

#include "stack/od/description.h"
#include "stack/scan/scanned_node.h"

namespace linegate::scan {

// Vendor-ID and product code (1018h:1, 2) are those of the file, and so is the major revision
// number (1018h:3, upper half); numbers that the file leaves 0 are not compared. Vendor-ID 0, as
// house-made devices have it, is that of the file if the device has it too, and the file a product
// code.
bool matches(const od::DeviceDescription& file, const ScannedNode& node);

// file: resolved with the node's node-ID. What differs from its defaults becomes a configured value
// (DCF ParameterValue); objects of the device that the file does not have come from describe().
od::DeviceDescription merge(od::DeviceDescription file, const ScannedNode& node);

}  // namespace linegate::scan
