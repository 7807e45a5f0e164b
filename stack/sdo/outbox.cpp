// SPDX-License-Identifier: Apache-2.0
#include "stack/sdo/outbox.h"

namespace linegate::sdo {

void Outbox::send_later(std::uint64_t word, Instant now, can::TransmitQueue& queue) {
  flush(now, queue);
  if (!empty() || !push(word, queue)) {
    keep(word, now);
  }
}

void Outbox::flush(Instant now, can::TransmitQueue& queue) {
  while (count_ > 0 && push(words_[0], queue)) {
    words_[0] = words_[1];
    --count_;
  }
  retry_at_ = now + kRetry;
}

void Outbox::keep(std::uint64_t word, Instant now) {
  if (count_ == words_.size()) {
    --count_;
  }
  words_[count_++] = word;
  retry_at_ = now + kRetry;
}

}  // namespace linegate::sdo
