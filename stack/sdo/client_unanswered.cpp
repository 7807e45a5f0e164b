// SPDX-License-Identifier: Apache-2.0
// Requests of a timed-out transfer that are still on their way to the bus, and their answers. An
// answer to the old request is indistinguishable from an answer to the next request on the same
// object, so the next one waits.
#include <utility>

#include "stack/base/assert.h"
#include "stack/base/time.h"
#include "stack/sdo/client.h"

namespace linegate::sdo {

void Client::follow(const RequestsUnderWay& under_way, std::uint8_t node) {
  under_way_ = &under_way;
  node_ = node;
}

// Aligned to a common time grid, so that all clients of a line share wake-ups.
Instant Client::next_look(Instant now) {
  return now - now.time_since_epoch() % kLookAgain + kLookAgain;
}

bool Client::is_under_way(const can::TransmitQueue& queue) const {
  return outbox_.waits(queue) || (under_way_ != nullptr && under_way_->any(node_));
}

// Call it when a request timed out.
void Client::note_unanswered(Instant now, const can::TransmitQueue& queue) {
  if (!held_ && is_under_way(queue)) {
    unanswered_ = Unanswered::under_way;
    answer_came_ = false;
    answer_time_ = timeout_;
    look_again_ = next_look(now);
  }
}

// Call it with a response that does not belong to the current transfer. The acknowledgement may be
// reported after the response.
void Client::note_answer(Instant now, can::TransmitQueue& queue) {
  if (unanswered_ == Unanswered::nothing || outbox_.waits(queue)) {
    return;
  }
  answer_came_ = true;
  if (unanswered_ == Unanswered::due) {
    look_again_ = now;
  }
  follow_unanswered(now, queue);
}

void Client::follow_unanswered(Instant now, can::TransmitQueue& queue) {
  if (unanswered_ == Unanswered::under_way) {
    if (is_under_way(queue)) {
      look_again_ = next_look(now);
      return;
    }
    unanswered_ = Unanswered::due;
    look_again_ = answer_came_ ? now : deadline(now, answer_time_);
    deadline_ = held_ ? kNever : deadline_;
  }
  if (now < look_again_) {
    return;
  }
  unanswered_ = Unanswered::nothing;
  look_again_ = kNever;
  if (held_) {
    deadline_ = now + timeout_;
    outbox_.send(*std::exchange(held_, std::nullopt), now, queue);
  }
}

// The first request of a transfer.
void Client::hold(std::uint64_t word, Instant now) {
  LINEGATE_ASSERT(!held_ && unanswered_ != Unanswered::nothing,
                  "one request waits for the responses to an earlier one");
  held_ = word;
  deadline_ = unanswered_ == Unanswered::due ? kNever : now + timeout_;
}

}  // namespace linegate::sdo
