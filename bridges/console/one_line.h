// SPDX-License-Identifier: Apache-2.0
// The JSON output of the console.
#pragma once

#include <string>

#include <nlohmann/json_fwd.hpp>

namespace linegate::console {

// Prints on one line. Names come from foreign participants: invalid UTF-8 is replaced, not refused,
// and control characters are escaped, including U+007F to U+009F, which JSON permits and terminals
// may interpret.
std::string one_line(const nlohmann::json& json);
std::string one_line(const nlohmann::ordered_json& json);

}  // namespace linegate::console
