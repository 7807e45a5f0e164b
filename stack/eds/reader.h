// SPDX-License-Identifier: Apache-2.0
// Reading electronic data sheets (EDS) and device configuration files (DCF) of CiA 306.
//
// Files from the field are sloppy. What would make Linegate do the wrong thing with a device is an
// error; what merely describes it badly is a warning, says what is assumed instead, and the rest of
// the file is used. All findings are reported at once. README.md lists what is understood.
#pragma once

#include <cstdint>
#include <string_view>

#include "stack/base/diagnostic.h"
#include "stack/eds/data_sheet.h"
#include "stack/eds/ini.h"

namespace linegate::eds {

// text: the whole file, in ASCII, Latin-1 or UTF-8. file_name: for messages, and
// DeviceDescription::file. node_id: 1..127, what $NODEID stands for; 0 takes the NodeID of a DCF's
// [DeviceCommissioning], and is an error if there is none and a value depends on it.
//
// Names in the description are UTF-8. Values are little-endian with the node-ID applied; a value
// that is not given is empty, except for sub-index 0 of arrays and records, where it is the highest
// sub-index (not so in 1003h and PDO mappings, whose sub-index 0 counts what is in use).
Loaded<DataSheet> read(std::string_view text, std::string_view file_name, std::uint8_t node_id);

// The same from sections that were written in another syntax; report has what was said of that.
Loaded<DataSheet> read(const Ini& sections, Report report, std::string_view file_name,
                       std::uint8_t node_id);

// Only the device of it.
Loaded<od::DeviceDescription> load(std::string_view text, std::string_view file_name,
                                   std::uint8_t node_id);

}  // namespace linegate::eds
