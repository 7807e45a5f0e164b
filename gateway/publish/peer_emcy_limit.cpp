// SPDX-License-Identifier: Apache-2.0
#include "gateway/publish/peer_emcy_limit.h"

#include <algorithm>

#include "stack/base/assert.h"

namespace linegate::gateway {

void PeerEmcyLimit::share_among(std::size_t lines) {
  LINEGATE_ASSERT(lines >= 1, "no line shares");
  const auto count = static_cast<double>(lines);
  burst_ = std::clamp(kAllBurst / count, 1.0, kLineBurst);
  per_second_ = std::min(kAllPerSecond / count, kLinePerSecond);
  line_.set_rate(burst_, per_second_);
  for (auto& [node, carrier] : carriers_) {
    carrier.set_rate(std::max(1.0, kCarrierBurst * burst_), kCarrierPerSecond * per_second_);
  }
}

TokenBucket& PeerEmcyLimit::carrier_of(std::uint8_t node) {
  const TokenBucket full(std::max(1.0, kCarrierBurst * burst_), kCarrierPerSecond * per_second_);
  return carriers_.try_emplace(node, full).first->second;
}

bool PeerEmcyLimit::admit(std::uint8_t carrier, std::uint16_t network, std::uint8_t node,
                          Instant now) {
  std::erase_if(sources_, [now](const auto& source) { return source.second.is_full(now); });
  const auto known = sources_.find({network, node});
  if (known != sources_.end() && !known->second.has_token(now)) {
    return false;
  }
  TokenBucket* const through = carrier == 0 ? nullptr : &carrier_of(carrier);
  if ((through != nullptr && !through->has_token(now)) || !line_.has_token(now)) {
    return false;
  }
  line_.take();
  if (through != nullptr) {
    through->take();
  }
  const auto source =
      sources_.try_emplace({network, node}, TokenBucket(kNodeBurst, kNodePerSecond)).first;
  (void)source->second.has_token(now);
  source->second.take();
  return true;
}

}  // namespace linegate::gateway
