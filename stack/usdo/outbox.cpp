// SPDX-License-Identifier: Apache-2.0
#include "stack/usdo/outbox.h"

#include <algorithm>
#include <utility>

namespace linegate::usdo {

bool FrameOutbox::push(const can::Frame& frame, can::TransmitQueue& queue) const {
  if (queue.room(can::TransmitClass::sdo) == 0 || !permitted()) {
    return false;
  }
  count({frame.id, frame.length, frame.flags});
  return queue.push(can::TransmitClass::sdo, frame);
}

bool FrameOutbox::send(const can::Frame& frame, Instant now, can::TransmitQueue& queue) {
  if (count_ == 0 && push(frame, queue)) {
    return true;
  }
  if (count_ == waiting_.size()) {
    return false;
  }
  waiting_[count_++] = frame;
  retry_at_ = now + kRetry;
  return true;
}

bool FrameOutbox::send_urgent(const can::Frame& frame, Instant now, can::TransmitQueue& queue) {
  count({frame.id, frame.length, frame.flags});
  sdo::Pace* const pace = std::exchange(pace_, nullptr);
  const bool sent = send(frame, now, queue);
  pace_ = pace;
  return sent;
}

void FrameOutbox::flush(Instant now, can::TransmitQueue& queue) {
  std::size_t sent = 0;
  while (sent < count_ && push(waiting_[sent], queue)) {
    ++sent;
  }
  std::move(waiting_.begin() + static_cast<std::ptrdiff_t>(sent),
            waiting_.begin() + static_cast<std::ptrdiff_t>(count_), waiting_.begin());
  count_ -= sent;
  retry_at_ = now + kRetry;
}

}  // namespace linegate::usdo
