// SPDX-License-Identifier: Apache-2.0
// A token bucket.
#pragma once

#include <algorithm>
#include <cstdint>
#include <limits>

#include "bridges/dds/guard/wire.h"

namespace linegate::dds::guard {

// Holds kMost tokens at first and at most; gains one in kPrice nanoseconds.
template <Number kMost, std::int64_t kPrice>
class Tokens {
 public:
  // Takes `count`, >= 0, or none: false. now: ns of any clock.
  bool take(Number count, std::int64_t now) {
    if (count > kMost)
      return false;
    const std::int64_t spent = std::max(spent_, now - kMost * kPrice) + count * kPrice;
    if (spent > now)
      return false;
    spent_ = spent;
    return true;
  }

  // Gives back `count`, >= 0, that were taken.
  void give(Number count) { spent_ -= count * kPrice; }

 private:
  std::int64_t spent_ = std::numeric_limits<std::int64_t>::min();  // all tokens gained until then
};

}  // namespace linegate::dds::guard
