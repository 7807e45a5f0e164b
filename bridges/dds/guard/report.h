// SPDX-License-Identifier: Apache-2.0
// Reports dropped datagrams and ended TCP connections as sentences for a log.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "bridges/dds/guard/counters.h"
#include "stack/base/time.h"

namespace linegate::dds::guard {

// Each reason is reported at its first occurrence, and later at most once a minute with the number
// of datagrams since.
class Report {
 public:
  static constexpr Duration kPeriod = std::chrono::minutes(1);

  // Returns new sentences; usually empty.
  std::vector<std::string> update(const Counters& counters, Instant now);

 private:
  struct Reported {
    std::uint64_t count = 0;
    Instant next{};  // earliest time of the next report
  };

  std::array<Reported, kReasons> reported_{};
};

}  // namespace linegate::dds::guard
