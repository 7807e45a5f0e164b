// SPDX-License-Identifier: Apache-2.0
// Limits the rate of messages, so that a storm of one kind does not hide the others.
#pragma once

#include <cstdint>

#include "stack/base/time.h"

namespace linegate::gateway {

// Permits kBurst messages at once and kPerSecond on average, and counts suppressed ones.
class RateLimit {
 public:
  static constexpr double kBurst = 20;
  static constexpr double kPerSecond = 5;

  // Returns true if a message may be written now, and sets left_out to the number of suppressed
  // ones before it.
  bool admit(Instant now, std::uint64_t& left_out);

 private:
  double tokens_ = kBurst;
  Instant filled_{};
  std::uint64_t left_out_ = 0;
};

}  // namespace linegate::gateway
