// SPDX-License-Identifier: Apache-2.0
#include "stack/nmt/life_signs.h"

#include <algorithm>

#include "stack/base/assert.h"

namespace linegate::nmt {
namespace {

// A frame repeated by a controller is not a second heartbeat.
constexpr Duration kRepeated = std::chrono::milliseconds(5);

}  // namespace

// A change of state may cause a heartbeat within a period, so a shorter time reduces the learned
// period slowly.
void LifeSigns::heartbeat(std::uint8_t id, Instant now) {
  Node& node = nodes_[id];
  if (node.last != kNever) {
    const Duration time = now - node.last;
    if (time < kRepeated) {
      return;
    }
    node.period = std::max(time, node.period * 3 / 4);
  }
  node.last = now;
  hold(id, now + (node.period == Duration{} ? kHold : std::max(node.period * kPeriods, kShortest)));
}

void LifeSigns::boot_up(std::uint8_t id, Instant now) {
  nodes_[id] = {};
  hold(id, now + kHold);
}

std::uint8_t LifeSigns::pop_expired(Instant now) {
  if (next_ > now) {
    return 0;
  }
  const auto first = std::ranges::min_element(nodes_, {}, &Node::expires);
  if (first->expires > now) {
    next_ = first->expires;
    return 0;
  }
  first->expires = kNever;
  return static_cast<std::uint8_t>(first - nodes_.begin());
}

void LifeSigns::hold(std::uint8_t id, Instant until) {
  LINEGATE_ASSERT(id < nodes_.size(), "the node-ID is 1..127");
  nodes_[id].expires = until;
  next_ = earlier(next_, until);
}

}  // namespace linegate::nmt
