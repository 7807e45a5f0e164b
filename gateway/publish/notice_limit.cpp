// SPDX-License-Identifier: Apache-2.0
#include "gateway/publish/notice_limit.h"

#include <utility>
#include <variant>

namespace linegate::gateway {

namespace {

// 0 = not known.
std::uint32_t client_of(const EventData& what) {
  if (const auto* const command = std::get_if<event::CommandRefused>(&what))
    return command->client;
  const auto* const output = std::get_if<event::OutputRefused>(&what);
  return output == nullptr ? 0 : output->client;
}

}  // namespace

bool NoticeLimit::admit(const EventData& what, Instant now) {
  Reported* free = nullptr;
  const std::uint32_t client = client_of(what);
  std::size_t of_client = 0;
  for (Reported& one : reported_) {
    if (one.until <= now) {
      free = &one;
    } else if (one.what == what) {
      return false;
    } else if (client != 0 && client_of(one.what) == client) {
      ++of_client;
    }
  }
  if (free == nullptr || of_client >= kOfOneClient) {
    ++suppressed_;
    return false;
  }
  *free = {what, now + kPeriod};
  return true;
}

std::uint64_t NoticeLimit::pop_suppressed(Instant now) {
  if (suppressed_ == 0 || now < suppressed_due_) {
    return 0;
  }
  suppressed_due_ = now + kPeriod;
  return pop_suppressed();
}

std::uint64_t NoticeLimit::pop_suppressed() {
  return std::exchange(suppressed_, 0);
}

}  // namespace linegate::gateway
