// SPDX-License-Identifier: Apache-2.0
// Numbered time-outs in a heap that is corrected lazily: to postpone a time-out only stores its
// time; the heap is updated when the old time is reached.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "stack/base/time.h"

namespace linegate::pdo {

class Timers {
 public:
  // Stops all time-outs; their numbers are 0..count-1 from now on. Allocates.
  void reset(std::size_t count) {
    timers_.assign(count, {});
    heap_.clear();
    heap_.reserve(count);
  }

  void set(std::size_t number, Instant due) {
    Timer& timer = timers_[number];
    timer.due = due;
    if (due >= timer.queued) {
      return;
    }
    if (timer.queued == kNever) {
      timer.queued = due;
      heap_.push_back({due, static_cast<std::uint32_t>(number)});
      std::push_heap(heap_.begin(), heap_.end(), later);
      return;
    }
    timer.queued = due;
    std::find_if(heap_.begin(), heap_.end(), [number](const Item& item) {
      return item.number == number;
    })->due = due;
    std::make_heap(heap_.begin(), heap_.end(), later);
  }
  void stop(std::size_t number) { timers_[number].due = kNever; }

  // Stops a due time-out and returns its number; nothing if none is due.
  std::optional<std::size_t> pop_due(Instant now) {
    while (!heap_.empty() && heap_.front().due <= now) {
      std::pop_heap(heap_.begin(), heap_.end(), later);
      const std::size_t number = heap_.back().number;
      heap_.pop_back();
      Timer& timer = timers_[number];
      timer.queued = kNever;
      const Instant due = timer.due;
      timer.due = kNever;
      if (due <= now) {
        return number;
      }
      set(number, due);
    }
    return std::nullopt;
  }

  // Not later than the next time-out.
  Instant next() const { return heap_.empty() ? kNever : heap_.front().due; }

 private:
  struct Timer {
    Instant due = kNever;
    Instant queued = kNever;  // time in the heap; never later than due
  };
  struct Item {
    Instant due;
    std::uint32_t number;
  };
  static bool later(const Item& a, const Item& b) {
    return a.due != b.due ? a.due > b.due : a.number > b.number;
  }

  std::vector<Timer> timers_;
  std::vector<Item> heap_;
};

}  // namespace linegate::pdo
