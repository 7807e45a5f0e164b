// SPDX-License-Identifier: Apache-2.0
// Loads a complete device file, for tools that derive another one from it.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "stack/eds/data_sheet.h"

namespace linegate::config {

// Reads an EDS, DCF, XDD or XDC; nothing if it cannot be read or has errors.
std::optional<eds::DataSheet> load_sheet(const std::string& path, std::uint8_t node_id);

}  // namespace linegate::config
