// SPDX-License-Identifier: Apache-2.0
#include "gateway/runtime/route_links.h"

#include <algorithm>

namespace linegate::gateway {

void RouteEnd::forget(std::uint8_t interface) {
  out_[interface] = nullptr;
  std::erase_if(in_, [&](const RouteLink* link) { return link->from == interface; });
}

bool RouteEnd::arrived() const {
  return std::any_of(in_.begin(), in_.end(),
                     [](RouteLink* link) { return !link->messages.empty(); });
}

bool RouteEnd::put(RouteLink& link) {
  if (!link.messages.push(message_)) {
    return false;
  }
  if (link.taker != nullptr &&
      std::find(touched_.begin(), touched_.end(), &link) == touched_.end()) {
    touched_.push_back(&link);
  }
  return true;
}

void RouteEnd::wake_takers() {
  for (RouteLink* const link : touched_) {
    link->taker->signal();
  }
  touched_.clear();
}

}  // namespace linegate::gateway
