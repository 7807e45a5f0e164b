// SPDX-License-Identifier: Apache-2.0
// Frames of one SDO channel on their way to the transmit queue. A full queue delays them, it never
// loses one.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "stack/base/assert.h"
#include "stack/base/time.h"
#include "stack/can/transmit_queue.h"
#include "stack/sdo/protocol.h"

namespace linegate::sdo {

class Outbox {
 public:
  static constexpr Duration kRetry = std::chrono::milliseconds(1);
  static constexpr std::size_t kMany = 32;  // frames: more than 1 Mbit/s carry until kRetry is over

  explicit Outbox(can::CobId cob_id) { set_cob_id(cob_id); }

  void set_cob_id(can::CobId cob_id) {
    cob_id_ = cob_id;
    header_ = cob_id.header(kFrameSize);
  }
  can::CobId cob_id() const { return cob_id_; }

  // Sends, or keeps for flush(). An SDO channel never has more than an abort and one request or
  // answer under way; if there is more all the same, the newest takes the place of the one before.
  void send(std::uint64_t word, Instant now, can::TransmitQueue& queue) {
    if (!empty() || !push(word, queue)) [[unlikely]] {
      send_later(word, now, queue);
    }
  }
  // Whether send() would send at once.
  bool ready(const can::TransmitQueue& queue) const {
    return empty() && queue.room(can::TransmitClass::sdo) > 0;
  }
  // Sends. Precondition: ready(queue).
  void send_at_once(std::uint64_t word, can::TransmitQueue& queue) const {
    LINEGATE_ASSERT_HOT(ready(queue), "the frame can be sent at once");
    queue.push_into_room(can::TransmitClass::sdo, header_, word);
  }
  void flush(Instant now, can::TransmitQueue& queue);

  // Whether one of many frames may be sent: nothing is to be sent before, and no more than a few
  // SDO frames wait for the bus, because others want to get their requests through. If not, try
  // again when kRetry has passed.
  bool has_room_for_many(const can::TransmitQueue& queue) const {
    return empty() && queue.queued(can::TransmitClass::sdo) < kMany &&
           queue.room(can::TransmitClass::sdo) > 0;
  }

  // A frame of this channel was not handed out yet.
  bool waits(const can::TransmitQueue& queue) const {
    return !empty() || queue.holds(can::TransmitClass::sdo, header_);
  }

  // Keeps a frame's data without trying to send it.
  void keep(std::uint64_t word, Instant now);

  bool empty() const { return count_ == 0; }
  Instant next_wake() const { return empty() ? kNever : retry_at_; }
  void clear() { count_ = 0; }

 private:
  bool push(std::uint64_t word, can::TransmitQueue& queue) const {
    return queue.room(can::TransmitClass::sdo) > 0 &&
           queue.push(can::TransmitClass::sdo, header_, word);
  }
  void send_later(std::uint64_t word, Instant now, can::TransmitQueue& queue);

  can::CobId cob_id_;
  can::Header header_;  // of its frames
  std::array<std::uint64_t, 2> words_{};
  std::size_t count_ = 0;
  Instant retry_at_ = kNever;
};

}  // namespace linegate::sdo
