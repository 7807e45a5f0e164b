// SPDX-License-Identifier: Apache-2.0
// Reading device descriptions in XML: XDD, and XDC for a configured device (CiA 311).
#pragma once

#include <cstdint>
#include <string_view>

#include "stack/eds/reader.h"

namespace linegate::xdd {

// Whether a file of that name is one, by its end: .xdd or .xdc in any case.
bool is_xdd(std::string_view file_name);

// As eds::read(), with the same rules for what is a warning and what an error: the XML is taken
// apart into the sections and keys of CiA 306 that say the same, each with its place. Findings
// therefore name keys of CiA 306 (DefaultValue for defaultValue). text: UTF-8 or Latin-1.
//
// An attribute of an object counts more than the parameter of the application process that
// uniqueIDRef names. An XDC is told by its deviceCommissioning; actualValue is its ParameterValue.
Loaded<eds::DataSheet> read(std::string_view text, std::string_view file_name,
                            std::uint8_t node_id);

}  // namespace linegate::xdd
