// SPDX-License-Identifier: Apache-2.0
// A device file for a device that came without one: what a scan read, as an od::DeviceDescription.
//
// Objects have CiA's names and types where CiA 301 gives them. What PDOs map is known by its length
// alone: such an object is BOOLEAN for 1 bit and UNSIGNEDn otherwise, or OCTET_STRING where CiA has
// no type of that length, read-only when it is sent and rww when it is received. Values are those
// that the device has, as defaults: a manager that boots the device with this has nothing to write.
#pragma once

#include "stack/od/description.h"
#include "stack/scan/scanned_node.h"

namespace linegate::scan {

od::DeviceDescription describe(const ScannedNode& node);

}  // namespace linegate::scan
