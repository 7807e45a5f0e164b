// SPDX-License-Identifier: Apache-2.0
// JSON on one line.
#pragma once

#include <string>

#include <nlohmann/json.hpp>

namespace linegate::gateway {

using Json = nlohmann::ordered_json;  // members keep the order in which they are added

// Octets that are not UTF-8 (file names) become U+FFFD.
inline std::string json_text(const Json& json) {
  return json.dump(-1, ' ', false, Json::error_handler_t::replace);
}

}  // namespace linegate::gateway
