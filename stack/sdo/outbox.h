// SPDX-License-Identifier: Apache-2.0
// Passes the frames of one SDO channel to the transmit queue. A full queue delays them, and never
// loses one.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <utility>

#include "stack/base/assert.h"
#include "stack/base/time.h"
#include "stack/can/transmit_queue.h"
#include "stack/sdo/pace.h"
#include "stack/sdo/protocol.h"

namespace linegate::sdo {

class Outbox {
 public:
  static constexpr Duration kRetry = std::chrono::milliseconds(1);
  static constexpr std::size_t kMany = 32;  // frames: more than 1 Mbit/s carries within kRetry

  explicit Outbox(can::CobId cob_id) { set_cob_id(cob_id); }

  void set_cob_id(can::CobId cob_id) {
    cob_id_ = cob_id;
    header_ = cob_id.header(kFrameSize);
  }
  can::CobId cob_id() const { return cob_id_; }

  // Sends the frame, or keeps it for flush(). An SDO channel has at most an abort and one request
  // or answer to send; a further frame replaces the last one.
  void send(std::uint64_t word, Instant now, can::TransmitQueue& queue) {
    if (!empty() || !push(word, queue)) [[unlikely]] {
      send_later(word, now, queue);
    }
  }
  // Whether send() would send immediately.
  bool ready(const can::TransmitQueue& queue) const {
    return empty() && queue.room(can::TransmitClass::sdo) > 0;
  }
  // Precondition: ready(queue).
  void send_at_once(std::uint64_t word, can::TransmitQueue& queue) const {
    LINEGATE_ASSERT_HOT(ready(queue), "the frame can be sent at once");
    queue.push_into_room(can::TransmitClass::sdo, header_, word);
  }
  void flush(Instant now, can::TransmitQueue& queue);

  // Whether one segment of many may be sent: no frame of this channel waits, and only a few SDO
  // frames wait for the bus, so that requests to other nodes are not delayed. If not, try again
  // after kRetry.
  bool has_room_for_many(const can::TransmitQueue& queue) const {
    return empty() && queue.queued(can::TransmitClass::sdo) < kMany &&
           queue.room(can::TransmitClass::sdo) > 0 && permitted();
  }

  // A frame of this channel was not handed out to the bus yet.
  bool waits(const can::TransmitQueue& queue) const {
    return !empty() || queue.holds(can::TransmitClass::sdo, header_);
  }

  // Keeps a frame without an attempt to send it.
  void keep(std::uint64_t word, Instant now);

  bool empty() const { return count_ == 0; }
  Instant next_wake() const { return empty() ? kNever : retry_at_; }
  void clear() { count_ = 0; }

  // Limits the frames from now on, as those of that client; nullptr: no longer.
  void set_pace(Pace* pace, std::uint32_t client) {
    pace_ = pace;
    client_ = client;
  }
  // Whether another client waits for the end of the transfer, see Pace::permits().
  void set_awaited(bool awaited) { awaited_ = awaited; }
  // Sends the frame like send(), counted, but without waiting for the pace.
  void send_urgent(std::uint64_t word, Instant now, can::TransmitQueue& queue) {
    count_received();
    Pace* const pace = std::exchange(pace_, nullptr);
    send(word, now, queue);
    pace_ = pace;
  }
  // Whether frames wait because of the pace.
  bool is_paced() const { return !empty() && !permitted(); }
  // A frame of the server was received.
  void count_received() const {
    if (pace_ != nullptr) {
      pace_->count(client_);
    }
  }

 private:
  bool push(std::uint64_t word, can::TransmitQueue& queue) const {
    if (queue.room(can::TransmitClass::sdo) == 0 || !permitted()) {
      return false;
    }
    if (pace_ != nullptr) [[unlikely]] {
      pace_->count(client_);
    }
    return queue.push(can::TransmitClass::sdo, header_, word);
  }
  bool permitted() const { return pace_ == nullptr || pace_->permits(client_, awaited_); }
  void send_later(std::uint64_t word, Instant now, can::TransmitQueue& queue);

  can::CobId cob_id_;
  can::Header header_;  // identifier and format of its frames
  std::array<std::uint64_t, 2> words_{};
  std::size_t count_ = 0;
  Instant retry_at_ = kNever;
  Pace* pace_ = nullptr;
  std::uint32_t client_ = 0;
  bool awaited_ = false;
};

}  // namespace linegate::sdo
