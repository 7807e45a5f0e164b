// SPDX-License-Identifier: Apache-2.0
// Names of certificates (gateway/security/authority.h), which sections of plant.yaml have, too.
#pragma once

#include <algorithm>
#include <string_view>

namespace linegate::config {

// 1 to 64 letters, digits, '_', '-' and '.', the first one not '.'.
inline bool is_certificate_name(std::string_view name) {
  return !name.empty() && name.size() <= 64 && name.front() != '.' &&
         std::ranges::all_of(name, [](char c) {
           return (c >= 'A' && c <= 'Z') || (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') ||
                  c == '_' || c == '-' || c == '.';
         });
}

}  // namespace linegate::config
