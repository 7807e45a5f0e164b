// SPDX-License-Identifier: Apache-2.0
// JSON as the console prints it.
#pragma once

#include <string>

#include <nlohmann/json_fwd.hpp>

namespace linegate::console {

// On one line. Names come from strangers: what is no UTF-8 is replaced, not refused, and control
// characters are escaped, those that JSON admits as they are too (U+007F to U+009F), because some
// of them steer a terminal.
std::string one_line(const nlohmann::json& json);
std::string one_line(const nlohmann::ordered_json& json);

}  // namespace linegate::console
