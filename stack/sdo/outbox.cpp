#include "stack/sdo/outbox.h"

namespace linegate::sdo {

void Outbox::send(std::uint64_t word, Instant now, can::TransmitQueue& queue) {
  if (!empty()) [[unlikely]] {
    flush(now, queue);
  }
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

bool Outbox::push(std::uint64_t word, can::TransmitQueue& queue) const {
  if (queue.room(can::TransmitClass::sdo) == 0) {
    return false;
  }
  can::Frame frame;
  set_header(frame, cob_id_);
  store_le(frame.data.data(), word);
  return queue.push(can::TransmitClass::sdo, frame);
}

}  // namespace linegate::sdo
