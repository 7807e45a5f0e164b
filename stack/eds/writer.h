// SPDX-License-Identifier: Apache-2.0
// Writes EDS and DCF (CiA 306). read() of the text returns the same data sheet, except for line
// numbers.
#pragma once

#include <string>

#include "stack/eds/data_sheet.h"

namespace linegate::eds {

// A data sheet for a device from another source (an object dictionary, an XDD): fills in the
// numbers of PDOs, the granularity and the version of the file. as_dcf adds the commissioning.
DataSheet sheet_of(od::DeviceDescription device, bool as_dcf = false);

// The device in its delivery state: without commissioning, configured values and the other keys
// that only a DCF has.
std::string write_eds(const DataSheet& sheet);

// Includes all of these. Without sheet.commissioning that section has only the node-ID.
std::string write_dcf(const DataSheet& sheet);

}  // namespace linegate::eds
