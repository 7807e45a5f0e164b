// SPDX-License-Identifier: Apache-2.0
#include "gateway/publish/notice_limit.h"

#include <utility>

namespace linegate::gateway {

bool NoticeLimit::admit(const EventData& what, Instant now) {
  Reported* free = nullptr;
  for (Reported& one : reported_) {
    if (one.until <= now) {
      free = &one;
    } else if (one.what == what) {
      return false;
    }
  }
  if (free == nullptr) {
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
