// SPDX-License-Identifier: Apache-2.0
// Passes the frames of one USDO client or server to the transmit queue. A full queue delays them.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "stack/base/time.h"
#include "stack/can/frame.h"
#include "stack/can/transmit_queue.h"
#include "stack/sdo/pace.h"

namespace linegate::usdo {

class FrameOutbox {
 public:
  static constexpr Duration kRetry = std::chrono::milliseconds(1);
  // A client has at most an abort and a request to send; a server one answer for each of a few
  // sessions. A further frame is dropped: its receiver times out.
  static constexpr std::size_t kPlaces = 4;

  // Sends the frame, or keeps it for flush(). Returns false if it was dropped.
  bool send(const can::Frame& frame, Instant now, can::TransmitQueue& queue);
  // The same without waiting for the pace, counted nevertheless.
  bool send_urgent(const can::Frame& frame, Instant now, can::TransmitQueue& queue);
  void flush(Instant now, can::TransmitQueue& queue);
  Instant next_wake() const { return count_ == 0 ? kNever : retry_at_; }
  bool empty() const { return count_ == 0; }
  void clear() { count_ = 0; }

  // See sdo::Outbox.
  void set_pace(sdo::Pace* pace, std::uint32_t client) {
    pace_ = pace;
    client_ = client;
  }
  void set_awaited(bool awaited) { awaited_ = awaited; }
  bool is_paced() const { return count_ != 0 && !permitted(); }
  // A frame in either direction.
  void count(const can::Header& frame) const {
    if (pace_ != nullptr) {
      pace_->count(client_, frame);
    }
  }

 private:
  bool permitted() const { return pace_ == nullptr || pace_->permits(client_, awaited_); }
  bool push(const can::Frame& frame, can::TransmitQueue& queue) const;

  std::array<can::Frame, kPlaces> waiting_{};
  std::size_t count_ = 0;
  Instant retry_at_ = kNever;
  sdo::Pace* pace_ = nullptr;
  std::uint32_t client_ = 0;
  bool awaited_ = false;
};

}  // namespace linegate::usdo
