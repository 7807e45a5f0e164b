// SPDX-License-Identifier: Apache-2.0
// What the guard dropped, as sentences for a log.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "bridges/dds/guard/counters.h"
#include "stack/base/time.h"

namespace linegate::dds::guard {

// Each reason is reported when it occurs for the first time, later at most once a minute with the
// number of datagrams since.
class Report {
 public:
  static constexpr Duration kPeriod = std::chrono::minutes(1);

  // Nothing in most calls.
  std::vector<std::string> update(const Counters& counters, Instant now);

 private:
  struct Reported {
    std::uint64_t count = 0;
    Instant next{};  // not before
  };

  std::array<Reported, kReasons> reported_{};
};

}  // namespace linegate::dds::guard
