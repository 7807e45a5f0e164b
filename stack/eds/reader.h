// SPDX-License-Identifier: Apache-2.0
// Reads electronic data sheets (EDS) and device configuration files (DCF) of CiA 306.
//
// Many files in the field are incorrect. A finding that would make Linegate treat a device wrongly
// is an error. A finding that only makes the description incomplete is a warning, which states the
// assumption made, and the rest of the file is used. All findings are reported at once. README.md
// lists the supported content.
#pragma once

#include <cstdint>
#include <string_view>

#include "stack/base/diagnostic.h"
#include "stack/eds/data_sheet.h"
#include "stack/eds/ini.h"

namespace linegate::eds {

// text: the whole file, in ASCII, Latin-1 or UTF-8. file_name: for messages, and
// DeviceDescription::file. node_id: 1..127, the value of $NODEID; 0 uses the NodeID of a DCF's
// [DeviceCommissioning], and is an error if there is none and a value depends on it.
//
// Names in the description are UTF-8. Values are little-endian with the node-ID applied; a missing
// value is empty, except for sub-index 0 of arrays and records, where it is the highest sub-index
// (but not in 1003h and PDO mappings, whose sub-index 0 is the number of entries in use).
Loaded<DataSheet> read(std::string_view text, std::string_view file_name, std::uint8_t node_id);

// The same for sections from another syntax; report has the findings of its parser.
Loaded<DataSheet> read(const Ini& sections, Report report, std::string_view file_name,
                       std::uint8_t node_id);

// Returns only the device of the data sheet.
Loaded<od::DeviceDescription> load(std::string_view text, std::string_view file_name,
                                   std::uint8_t node_id);

}  // namespace linegate::eds
