// SPDX-License-Identifier: Apache-2.0
#include "stack/od/deferrals.h"

#include <algorithm>

namespace linegate::od {

Ticket Deferrals::begin(Address address, Hook& hook) {
  do {
    ++last_;
  } while (last_ == 0 || outcome(last_) != AbortCode::no_data);
  const Ticket ticket = last_;
  waiting_.push_back({ticket, address, &hook, std::nullopt});
  hook.put_off(address, ticket);
  return ticket;
}

bool Deferrals::complete(Ticket ticket, AbortCode why) {
  const auto at = std::ranges::find(waiting_, ticket, &Waiting::ticket);
  if (at == waiting_.end() || at->outcome || why == kLater) {
    return false;
  }
  at->outcome = why;
  return true;
}

std::optional<AbortCode> Deferrals::outcome(Ticket ticket) const {
  const auto at = std::ranges::find(waiting_, ticket, &Waiting::ticket);
  return at == waiting_.end() ? std::optional(AbortCode::no_data) : at->outcome;
}

std::optional<Deferrals::Waiting> Deferrals::take(Ticket ticket) {
  const auto at = std::ranges::find(waiting_, ticket, &Waiting::ticket);
  if (at == waiting_.end()) {
    return std::nullopt;
  }
  const Waiting taken = *at;
  waiting_.erase(at);
  return taken;
}

void Deferrals::refuse(std::uint16_t index, const Hook* hook, AbortCode why) {
  for (Waiting& access : waiting_) {
    if (access.address.index == index && !access.outcome &&
        (hook == nullptr || access.hook == hook)) {
      access.outcome = why;
    }
  }
}

}  // namespace linegate::od
