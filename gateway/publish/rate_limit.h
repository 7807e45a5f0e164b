// SPDX-License-Identifier: Apache-2.0
// Limits the rate of messages, so that a storm of one kind does not hide the others.
#pragma once

#include <cstdint>

#include "stack/base/time.h"

namespace linegate::gateway {

// Permits `burst` messages at once and `per_second` on average. Full at first.
class TokenBucket {
 public:
  TokenBucket(double burst, double per_second)
      : burst_(burst), per_second_(per_second), tokens_(burst) {}

  // A bucket that has more is then full.
  void set_rate(double burst, double per_second);
  bool has_token(Instant now);
  // Only if has_token().
  void take() { tokens_ -= 1; }
  bool is_full(Instant now) const { return tokens_at(now) >= burst_; }

 private:
  double tokens_at(Instant now) const;

  double burst_;
  double per_second_;
  double tokens_;
  Instant filled_{};
};

// Permits kBurst messages at once and kPerSecond on average, and counts suppressed ones.
class RateLimit {
 public:
  static constexpr double kBurst = 20;
  static constexpr double kPerSecond = 5;

  // Returns true if a message may be written now, and sets left_out to the number of suppressed
  // ones before it.
  bool admit(Instant now, std::uint64_t& left_out);

 private:
  TokenBucket bucket_{kBurst, kPerSecond};
  std::uint64_t left_out_ = 0;
};

}  // namespace linegate::gateway
