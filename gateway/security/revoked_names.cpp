// SPDX-License-Identifier: Apache-2.0
#include "gateway/security/revoked_names.h"

#include <fstream>

namespace linegate::security {

std::optional<NameSet> read_revoked_names(const std::string& file) {
  NameSet out;
  std::ifstream in(file);
  if (!in.is_open())
    return std::nullopt;
  for (std::string line; std::getline(in, line) && !in.eof();) {
    if (!line.empty())
      out.insert(line);
  }
  if (in.bad())
    return std::nullopt;
  return out;
}

void RevokedNames::update(Instant now) {
  if (!was_tried_ || now - tried_ >= kPeriod) {
    if (auto read = read_revoked_names(file_)) {
      names_.merge(*read);
      is_known_ = true;
    }
    was_tried_ = true;
    tried_ = now;
  }
}

bool RevokedNames::contains(std::string_view role, std::string_view name, Instant now) {
  update(now);
  return !is_known_ || names_.contains(std::string(role).append("/").append(name));
}

}  // namespace linegate::security
