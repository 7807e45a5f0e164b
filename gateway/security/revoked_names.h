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

// A name that was read once remains revoked, even if the file no longer has it: the certificate
// that was revoked has the same subject as the one that was issued again, and the participant
// still has the revoked.crl of its start. So only a new process accepts that name again.
class RevokedNames {
 public:
  static constexpr Duration kPeriod = std::chrono::seconds(5);

  // file: kRevokedNamesFile of an identity.
  explicit RevokedNames(std::string file) : file_(std::move(file)) {}

  // Reads the file again if the last time was kPeriod before `now`. To call without requests too:
  // a name may be revoked and issued again between two requests. From one thread at a time.
  void update(Instant now);

  // Updates first. True for each name as long as the file could never be read. From the same thread
  // as update().
  bool contains(std::string_view role, std::string_view name, Instant now);

 private:
  std::string file_;
  NameSet names_;           // of each time that the file could be read
  bool is_known_ = false;   // the file could be read at least once
  bool was_tried_ = false;  // to read it
  Instant tried_{};
};

}  // namespace linegate::security
