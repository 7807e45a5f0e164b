// SPDX-License-Identifier: Apache-2.0
#include "gateway/security/revoked_names.h"

#include <fstream>

namespace linegate::security {

std::set<std::string, std::less<>> read_revoked_names(const std::string& file) {
  std::set<std::string, std::less<>> out;
  std::ifstream in(file);
  for (std::string line; std::getline(in, line);) {
    if (!line.empty())
      out.insert(line);
  }
  return out;
}

bool RevokedNames::contains(std::string_view role, std::string_view name, Instant now) {
  if (!was_read_ || now - read_ >= kPeriod) {
    names_ = read_revoked_names(file_);
    was_read_ = true;
    read_ = now;
  }
  return names_.contains(std::string(role).append("/").append(name));
}

}  // namespace linegate::security
