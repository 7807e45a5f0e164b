// SPDX-License-Identifier: Apache-2.0
#include "gateway/publish/peer_emcy_limit.h"

#include <algorithm>

#include "stack/base/assert.h"

namespace linegate::gateway {

void PeerEmcyLimit::share_among(std::size_t lines) {
  LINEGATE_ASSERT(lines >= 1, "no line shares");
  const auto count = static_cast<double>(lines);
  line_.set_rate(std::clamp(kAllBurst / count, 1.0, kLineBurst),
                 std::min(kAllPerSecond / count, kLinePerSecond));
}

bool PeerEmcyLimit::admit(std::uint16_t network, std::uint8_t node, Instant now) {
  std::erase_if(sources_, [now](const auto& source) { return source.second.is_full(now); });
  const auto known = sources_.find({network, node});
  if (known != sources_.end() && !known->second.has_token(now)) {
    return false;
  }
  if (!line_.has_token(now)) {
    return false;
  }
  line_.take();
  const auto source =
      sources_.try_emplace({network, node}, TokenBucket(kNodeBurst, kNodePerSecond)).first;
  (void)source->second.has_token(now);
  source->second.take();
  return true;
}

}  // namespace linegate::gateway
