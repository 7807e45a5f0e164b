// SPDX-License-Identifier: Apache-2.0
// A token bucket.
#pragma once

#include <algorithm>
#include <cstdint>
#include <limits>

#include "bridges/dds/guard/wire.h"

namespace linegate::dds::guard {

// Holds at most kMost tokens, also initially; gains one in kPrice nanoseconds.
template <Number kMost, std::int64_t kPrice>
class Tokens {
 public:
  // Takes `count` tokens, >= 0. Returns false, and takes none, if there are fewer. now: ns of any
  // clock.
  bool take(Number count, std::int64_t now) {
    if (count > kMost)
      return false;
    const std::int64_t spent = std::max(spent_, now - kMost * kPrice) + count * kPrice;
    if (spent > now)
      return false;
    spent_ = spent;
    return true;
  }

  // Puts back `count` tokens, >= 0, that were taken.
  void give(Number count) { spent_ -= count * kPrice; }

 private:
  // Time up to which all gained tokens are spent
  std::int64_t spent_ = std::numeric_limits<std::int64_t>::min();
};

}  // namespace linegate::dds::guard
