// SPDX-License-Identifier: Apache-2.0
// When a process with DDS must be replaced, because the host got an address that its participant
// does not use (AddressWatch).
#pragma once

#include <string>
#include <utility>

#include "bridges/dds/address_watch.h"
#include "stack/base/time.h"

namespace linegate::dds {

// From one thread at a time.
class AddressChange {
 public:
  // Between two looks at the addresses.
  static constexpr Duration kLook = std::chrono::seconds(1);
  // From a start to a replacement at the earliest. A process has created its participant within
  // this time; one that is slower may be replaced once more than it need be.
  static constexpr Duration kPause = std::chrono::seconds(5);

  // watch: made before the first process is started.
  explicit AddressChange(AddressWatch watch) : watch_(std::move(watch)) {}

  // A process was started since the last due(), for whatever reason.
  void started(Instant now);
  // Why the process is to be replaced; empty: it is not. Call it several times a second.
  std::string due(Instant now);
  // It was asked to end, for this reason or another one.
  void ends(Instant now);

 private:
  AddressWatch watch_;
  bool starts_ = false;  // its participant may not be created yet
  Instant look_at_{};
  Instant not_before_{};
};

}  // namespace linegate::dds
