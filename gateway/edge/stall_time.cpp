// SPDX-License-Identifier: Apache-2.0
#include "gateway/edge/stall_time.h"

#include <algorithm>

namespace linegate::gateway {

Duration StallTime::count(int thread, Duration stall, Instant now) {
  if (stall < kObserved) {
    observed_.clear();
    return stall;
  }
  if (observed_.size() == kMostObserved) {
    observed_.erase(observed_.begin() + 1);
  }
  observed_.push_back({now, times_.read()});
  const Instant begin = now - stall;
  const auto first = std::ranges::find_if(
      observed_, [begin](const Observed& observed) { return observed.at >= begin; });
  const ProcessorUse use = use_between(first->sample, observed_.back().sample, thread);
  const Duration counted = now - first->at;
  const Duration slept = counted - use.running - use.waiting;
  return slept < counted / 50 ? counted : stall - use.waiting_of_all;
}

}  // namespace linegate::gateway
