// SPDX-License-Identifier: Apache-2.0
// The revoked identities by name. A running participant of Fast DDS 2.9.1 does not read revoked.crl
// again, and knows of its peers names only, not the serial numbers in that list.
#pragma once

#include <chrono>
#include <functional>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <utility>

#include "stack/base/time.h"

namespace linegate::security {

using NameSet = std::set<std::string, std::less<>>;

// "ROLE/NAME" of each revoked identity, one per line. Nothing if the file cannot be read. A last
// line without a line end is ignored: `cp` has written a part of the file only.
std::optional<NameSet> read_revoked_names(const std::string& file);

class RevokedNames {
 public:
  static constexpr Duration kPeriod = std::chrono::seconds(5);

  // file: kRevokedNamesFile of an identity.
  explicit RevokedNames(std::string file) : file_(std::move(file)) {}

  // Reads the file again if the last time was kPeriod before `now`. From one thread at a time.
  bool contains(std::string_view role, std::string_view name, Instant now);

 private:
  std::string file_;
  NameSet names_;
  bool was_read_ = false;
  Instant read_{};
};

}  // namespace linegate::security
