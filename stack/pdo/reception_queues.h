// SPDX-License-Identifier: Apache-2.0
// The receptions of those RPDOs of which each one is wanted, and not only the newest values.
//
// A queue for each of these PDOs, of fixed length: when it is full its oldest reception is dropped
// and counted. They come out in the order of reception, whatever PDO they are of. All room is
// allocated by assign().
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "stack/base/time.h"
#include "stack/can/frame.h"

namespace linegate::pdo {

class ReceptionQueues {
 public:
  struct Wanted {
    std::uint16_t slot = 0;
    std::uint32_t length = 1;  // receptions, at least 1
  };
  struct Raw {
    Instant time{};
    std::uint64_t number = 0;  // among those of all queues
    std::uint32_t lost = 0;    // before it, see Reception::lost
    std::uint16_t slot = 0;
    std::array<std::byte, can::kMaxFdData> data{};  // of the frame
  };

  // Ascending by slot, each slot once. What waits is dropped and counted.
  void assign(std::span<const Wanted> wanted);

  bool empty() const { return order_.empty(); }
  // Receptions dropped since the beginning; never goes back.
  std::uint64_t lost() const { return lost_; }

  // Precondition: the slot has a queue.
  void push(std::uint16_t slot, const can::Frame& frame);
  // The oldest of all. False if there is none.
  bool pop(Raw& out);

 private:
  struct Queue {
    std::uint16_t slot = 0;
    std::uint32_t lost = 0;  // since the last one that was taken
    std::size_t begin = 0;   // in places_
    std::size_t length = 0;
    std::size_t first = 0;  // from begin
    std::size_t count = 0;
  };
  // Of a queue with receptions: the number that its first had when this was written. A later one
  // took its place if that was dropped, see pop().
  struct Next {
    std::uint64_t number = 0;
    std::size_t queue = 0;
    bool operator>(const Next& other) const { return number > other.number; }
  };

  Queue& queue_of(std::uint16_t slot);
  void add_to_order(std::size_t queue);

  std::vector<Queue> queues_;  // ascending by slot
  std::vector<Raw> places_;
  std::vector<Next> order_;  // a heap, the lowest number first
  std::uint64_t number_ = 0;
  std::uint64_t lost_ = 0;
};

}  // namespace linegate::pdo
