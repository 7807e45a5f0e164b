// SPDX-License-Identifier: Apache-2.0
// Reading device descriptions in XML: XDD, and XDC for a configured device (CiA 311).
#pragma once

#include <cstdint>
#include <string_view>

#include "stack/eds/reader.h"

namespace linegate::xdd {

// Whether the file name ends with .xdd or .xdc, in any case.
bool is_xdd(std::string_view file_name);

// Reads an XDD or XDC as eds::read() reads an EDS, with the same rules for warnings and errors: the
// XML is converted to the equivalent sections and keys of CiA 306, each with its position. Findings
// therefore name keys of CiA 306 (DefaultValue for defaultValue). text: UTF-8 or Latin-1.
//
// An attribute of an object takes precedence over the parameter of the application process that
// uniqueIDRef names. deviceCommissioning marks an XDC; actualValue becomes ParameterValue.
Loaded<eds::DataSheet> read(std::string_view text, std::string_view file_name,
                            std::uint8_t node_id);

}  // namespace linegate::xdd
