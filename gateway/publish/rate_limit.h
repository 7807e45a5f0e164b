// SPDX-License-Identifier: Apache-2.0
// How often something may be said, so that a storm of it does not bury the rest.
#pragma once

#include <cstdint>

#include "stack/base/time.h"

namespace linegate::gateway {

// kBurst times at once and kPerSecond in the long run; what was left out is counted.
class RateLimit {
 public:
  static constexpr double kBurst = 20;
  static constexpr double kPerSecond = 5;

  // True if it may be said now; left_out becomes how many before it were not.
  bool admit(Instant now, std::uint64_t& left_out);

 private:
  double tokens_ = kBurst;
  Instant filled_{};
  std::uint64_t left_out_ = 0;
};

}  // namespace linegate::gateway
