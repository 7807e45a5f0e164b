// SPDX-License-Identifier: Apache-2.0
// How many own frames are in the kernel's queue, counted by their own echoes.
//
// The kernel sends in the order given, so an echo confirms its frame and every one before it:
// frames whose echo never came (a bus-off flushed them) do not take up room for ever.
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
  // A full window without an echo for so long lets one more frame try: the kernel's own limit
  // (ENOBUFS) then says whether the bus is stuck or an echo was missed.
  static constexpr Duration kStall = std::chrono::seconds(1);

  // depth: 1..kMaxDepth, others are brought into that range.
  explicit TransmitWindow(std::size_t depth);

  std::size_t room(Instant now) const;
  // When a full window lets one frame try; kNever if there is room anyway.
  Instant next_try() const;

  // A frame was handed to the kernel. number: by which confirmed_to() names it.
  void sent(const can::Frame& frame, Instant now, std::uint64_t number = 0);
  // Its echo came. Gives how many frames are known to have left by it; 0 if it matches none.
  std::size_t confirmed(const can::Frame& echo, Instant now);
  // The number of the frame that was confirmed last.
  std::uint64_t confirmed_to() const { return confirmed_to_; }
  // The number of the last frame whose own echo did not come before that of a later one, or which
  // made room for one that was to try.
  std::uint64_t skipped_to() const { return skipped_to_; }
  // The kernel's queue is known to be empty: interface down, bus-off, restart.
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

  std::array<Mark, kMaxDepth> marks_{};             // ring
  std::array<std::uint64_t, kMaxDepth> numbers_{};  // of the same frames
  std::uint64_t confirmed_to_ = 0;
  std::uint64_t skipped_to_ = 0;
  std::size_t first_ = 0;
  std::size_t count_ = 0;
  std::size_t depth_;
  Instant progress_{};  // last echo, or last frame sent into an empty or stalled window
};

}  // namespace linegate::can_bridge
