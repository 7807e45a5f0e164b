// SPDX-License-Identifier: Apache-2.0
// Writing EDS and DCF (CiA 306). What read() makes of the text is the same data sheet, but for the
// lines things stand in.
#pragma once

#include <string>

#include "stack/eds/data_sheet.h"

namespace linegate::eds {

// A data sheet around a device that comes from elsewhere (an object dictionary, an XDD): the
// numbers of PDOs, the granularity and the version of the file are filled in. as_dcf adds the
// commissioning.
DataSheet sheet_of(od::DeviceDescription device, bool as_dcf = false);

// The device as it is delivered: without commissioning, configured values and what else only a DCF
// has.
std::string write_eds(const DataSheet& sheet);

// With all of that. Without sheet.commissioning only the node-ID is written there.
std::string write_dcf(const DataSheet& sheet);

}  // namespace linegate::eds
