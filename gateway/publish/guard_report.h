// SPDX-License-Identifier: Apache-2.0
// What the guard of bridges/dds dropped, as sentences for the log.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "bridges/dds/guard/counters.h"
#include "stack/base/time.h"

namespace linegate::gateway {

// Each reason is reported when it occurs for the first time, later at most once a minute with the
// number of datagrams since.
class GuardReport {
 public:
  static constexpr Duration kPeriod = std::chrono::minutes(1);

  // Nothing in most calls.
  std::vector<std::string> update(const dds::guard::Counters& counters, Instant now);

 private:
  struct Reported {
    std::uint64_t count = 0;
    Instant next{};  // not before
  };

  std::array<Reported, dds::guard::kReasons> reported_{};
};

}  // namespace linegate::gateway
