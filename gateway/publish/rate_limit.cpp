// SPDX-License-Identifier: Apache-2.0
#include "gateway/publish/rate_limit.h"

#include <algorithm>
#include <chrono>
#include <utility>

namespace linegate::gateway {

bool RateLimit::admit(Instant now, std::uint64_t& left_out) {
  if (filled_ != Instant{}) {
    const double seconds = std::chrono::duration<double>(now - filled_).count();
    tokens_ = std::min(kBurst, tokens_ + seconds * kPerSecond);
  }
  filled_ = now;
  if (tokens_ < 1) {
    ++left_out_;
    return false;
  }
  tokens_ -= 1;
  left_out = std::exchange(left_out_, 0);
  return true;
}

}  // namespace linegate::gateway
