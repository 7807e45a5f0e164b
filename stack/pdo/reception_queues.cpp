// SPDX-License-Identifier: Apache-2.0
#include "stack/pdo/reception_queues.h"

#include <algorithm>
#include <functional>
#include <utility>

#include "stack/base/assert.h"

namespace linegate::pdo {

void ReceptionQueues::assign(std::span<const Wanted> wanted) {
  LINEGATE_ASSERT(std::ranges::adjacent_find(wanted, std::ranges::greater_equal{}, &Wanted::slot) ==
                      wanted.end(),
                  "the slots are ascending, each once");
  for (const Queue& queue : queues_) {
    lost_ += queue.count;
  }
  queues_.clear();
  order_.clear();
  std::size_t places = 0;
  for (const Wanted& each : wanted) {
    queues_.push_back({.slot = each.slot, .begin = places, .length = each.length});
    places += each.length;
  }
  places_.assign(places, {});
  order_.reserve(queues_.size());
}

ReceptionQueues::Queue& ReceptionQueues::queue_of(std::uint16_t slot) {
  const auto found = std::ranges::lower_bound(queues_, slot, {}, &Queue::slot);
  LINEGATE_ASSERT_HOT(found != queues_.end() && found->slot == slot, "the slot has a queue");
  return *found;
}

void ReceptionQueues::add_to_order(std::size_t queue) {
  const Queue& of = queues_[queue];
  order_.push_back({places_[of.begin + of.first].number, queue});
  std::ranges::push_heap(order_, std::greater<>{});
}

[[gnu::hot]] void ReceptionQueues::push(std::uint16_t slot, const can::Frame& frame) {
  Queue& queue = queue_of(slot);
  const bool was_empty = queue.count == 0;
  if (queue.count == queue.length) {
    queue.first = (queue.first + 1) % queue.length;
    --queue.count;
    ++queue.lost;
    ++lost_;
  }
  Raw& place = places_[queue.begin + (queue.first + queue.count) % queue.length];
  place.time = frame.time;
  place.number = ++number_;
  place.slot = slot;
  place.data = frame.data;
  ++queue.count;
  if (was_empty) {
    add_to_order(static_cast<std::size_t>(&queue - queues_.data()));
  }
}

bool ReceptionQueues::pop(Raw& out) {
  while (!order_.empty()) {
    std::ranges::pop_heap(order_, std::greater<>{});
    const Next next = order_.back();
    order_.pop_back();
    Queue& queue = queues_[next.queue];
    if (places_[queue.begin + queue.first].number != next.number) {
      add_to_order(next.queue);  // its first reception was dropped meanwhile
      continue;
    }
    out = places_[queue.begin + queue.first];
    out.lost = std::exchange(queue.lost, 0);
    queue.first = (queue.first + 1) % queue.length;
    if (--queue.count != 0) {
      add_to_order(next.queue);
    }
    return true;
  }
  return false;
}

}  // namespace linegate::pdo
