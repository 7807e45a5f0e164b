// SPDX-License-Identifier: Apache-2.0
// Limits the number of own frames in the kernel's queue, counted by their echoes.
//
// The kernel sends in order, so an echo confirms its frame and every earlier one: frames that never
// get an echo (flushed at bus-off) do not occupy the window for ever.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "stack/base/time.h"
#include "stack/can/frame.h"

namespace linegate::can_bridge {

class TransmitWindow {
 public:
  static constexpr std::size_t kMaxDepth = 16;
  // If a full window gets no echo for this long, one more frame is tried: the kernel's own limit
  // (ENOBUFS) then shows whether the bus is stuck or an echo was missed.
  static constexpr Duration kStall = std::chrono::seconds(1);

  // depth is clamped to 1..kMaxDepth.
  explicit TransmitWindow(std::size_t depth);

  std::size_t room(Instant now) const {
    return count_ < depth_ ? depth_ - count_ : now >= next_try() ? 1 : 0;
  }
  // When a full window permits one trial frame; kNever if there is room.
  Instant next_try() const { return count_ < depth_ ? kNever : progress_ + kStall; }

  // Call it when a frame was handed to the kernel. number: reported by confirmed_to().
  void sent(const can::Frame& frame, Instant now, std::uint64_t number = 0);
  // Call it with each echo. Returns how many frames are thereby known to be sent; 0 if the echo
  // matches none.
  std::size_t confirmed(const can::Frame& echo, Instant now);
  // The number of the last confirmed frame.
  std::uint64_t confirmed_to() const { return confirmed_to_; }
  // The number of the last frame whose echo did not precede that of a later frame, or that was
  // dropped from the window for a trial frame.
  std::uint64_t skipped_to() const { return skipped_to_; }
  // Call it when the kernel's queue is known to be empty: interface down, bus-off, restart.
  void clear() { count_ = 0; }

  std::size_t in_flight() const { return count_; }

 private:
  struct Mark {
    std::uint64_t head = 0;  // the first 8 bytes
    std::uint32_t id = 0;
    std::uint8_t length = 0;
    std::uint8_t flags = 0;

    friend bool operator==(const Mark&, const Mark&) = default;
  };
  static Mark mark(const can::Frame& frame);

  // First those that every send and every echo uses.
  std::size_t first_ = 0;
  std::size_t count_ = 0;
  std::size_t depth_;
  // Time of the last echo, or of the last frame sent into an empty or stalled window
  Instant progress_{};
  std::uint64_t confirmed_to_ = 0;
  std::uint64_t skipped_to_ = 0;
  std::array<Mark, kMaxDepth> marks_{};             // ring
  std::array<std::uint64_t, kMaxDepth> numbers_{};  // of the same frames
};

}  // namespace linegate::can_bridge
