// SPDX-License-Identifier: Apache-2.0
// Queues for RPDOs of which every reception is delivered, not only the newest values.
//
// Each of these PDOs has a queue of fixed length: when it is full, its oldest reception is dropped
// and counted. Receptions are returned in the order of reception across all PDOs. All memory is
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
    std::uint64_t number = 0;  // sequence number over all queues
    std::uint32_t lost = 0;    // see Reception::lost
    std::uint16_t slot = 0;
    std::array<std::byte, can::kMaxFdData> data{};  // of the frame
  };

  // Precondition: ascending by slot, each slot once. Queued receptions are dropped and counted.
  void assign(std::span<const Wanted> wanted);

  bool empty() const { return order_.empty(); }
  // Total number of dropped receptions; never decreases.
  std::uint64_t lost() const { return lost_; }

  // Precondition: the slot has a queue.
  void push(std::uint16_t slot, const can::Frame& frame);
  // Removes the oldest reception of all queues. Returns false if all are empty.
  bool pop(Raw& out);

 private:
  struct Queue {
    std::uint16_t slot = 0;
    std::uint32_t lost = 0;  // since the last reception that was popped
    std::size_t begin = 0;   // first index in places_
    std::size_t length = 0;
    std::size_t first = 0;  // index of the oldest reception, relative to begin
    std::size_t count = 0;
  };
  // A queue with receptions, and the number of its first one when this was written. If that was
  // dropped since, the first one has a higher number, see pop().
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
