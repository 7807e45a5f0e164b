// SPDX-License-Identifier: Apache-2.0
#include "gateway/publish/notice_limit.h"

#include <utility>

namespace linegate::gateway {

bool NoticeLimit::admit(EventKind kind, std::uint32_t code, std::uint32_t value, Instant now) {
  Told* free = nullptr;
  for (Told& told : told_) {
    if (told.until <= now) {
      free = &told;
    } else if (told.kind == kind && told.code == code && told.value == value) {
      return false;
    }
  }
  if (free == nullptr) {
    ++held_;
    return false;
  }
  *free = {kind, code, value, now + kPeriod};
  return true;
}

std::uint64_t NoticeLimit::take_held(Instant now) {
  if (held_ == 0 || now < held_due_) {
    return 0;
  }
  held_due_ = now + kPeriod;
  return take_held();
}

std::uint64_t NoticeLimit::take_held() {
  return std::exchange(held_, 0);
}

}  // namespace linegate::gateway
