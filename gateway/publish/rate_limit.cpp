// SPDX-License-Identifier: Apache-2.0
#include "gateway/publish/rate_limit.h"

#include <algorithm>
#include <chrono>
#include <utility>

namespace linegate::gateway {

void TokenBucket::set_rate(double burst, double per_second) {
  burst_ = burst;
  per_second_ = per_second;
  tokens_ = std::min(tokens_, burst_);
}

bool TokenBucket::has_token(Instant now) {
  tokens_ = tokens_at(now);
  filled_ = now;
  return tokens_ >= 1;
}

double TokenBucket::tokens_at(Instant now) const {
  const double seconds = std::chrono::duration<double>(now - filled_).count();
  return std::min(burst_, tokens_ + seconds * per_second_);
}

bool RateLimit::admit(Instant now, std::uint64_t& left_out) {
  if (!bucket_.has_token(now)) {
    ++left_out_;
    return false;
  }
  bucket_.take();
  left_out = std::exchange(left_out_, 0);
  return true;
}

}  // namespace linegate::gateway
