// SPDX-License-Identifier: Apache-2.0
// A bounded queue between exactly one producing and one consuming thread.
#pragma once

#include <atomic>
#include <bit>
#include <cstddef>
#include <utility>
#include <vector>

#include "stack/base/assert.h"

namespace linegate::exchange {

// Data that different threads write is on different cache lines.
inline constexpr std::size_t kCacheLine = 64;

// Wait-free; never allocates after construction. Elements are swapped in and out, so that their
// buffers are reused and neither allocated nor freed.
template <class T>
class Ring {
 public:
  // The number of places is the next power of two >= capacity, at least 2.
  explicit Ring(std::size_t capacity)
      : slots_(std::bit_ceil(capacity < 2 ? std::size_t{2} : capacity)), mask_(slots_.size() - 1) {}
  Ring(const Ring&) = delete;
  Ring& operator=(const Ring&) = delete;

  std::size_t capacity() const { return slots_.size(); }

  // --- producer -------------------------------------------------------------------------------

  // Lower bound of the number of elements that can be pushed now.
  std::size_t room() {
    head_cache_ = head_.load(std::memory_order_acquire);
    return slots_.size() - (tail_.load(std::memory_order_relaxed) - head_cache_);
  }

  // Returns false if the ring is full: value is unchanged. Otherwise value becomes the previous
  // content of the slot.
  bool push(T& value) {
    const std::size_t tail = tail_.load(std::memory_order_relaxed);
    if (tail - head_cache_ == slots_.size()) {
      head_cache_ = head_.load(std::memory_order_acquire);
      if (tail - head_cache_ == slots_.size()) {
        return false;
      }
    }
    LINEGATE_ASSERT_HOT(tail - head_cache_ < slots_.size(), "the place is free");
    std::swap(slots_[tail & mask_], value);
    tail_.store(tail + 1, std::memory_order_release);
    return true;
  }
  bool push(T&& value) {
    T local = std::move(value);
    if (push(local)) {
      return true;
    }
    value = std::move(local);
    return false;
  }

  // --- consumer -------------------------------------------------------------------------------

  // Whether pop() would return false.
  bool empty() {
    if (head_.load(std::memory_order_relaxed) == tail_cache_) {
      tail_cache_ = tail_.load(std::memory_order_acquire);
    }
    return head_.load(std::memory_order_relaxed) == tail_cache_;
  }

  // Returns false if the ring is empty: out is unchanged.
  bool pop(T& out) {
    const std::size_t head = head_.load(std::memory_order_relaxed);
    if (head == tail_cache_) {
      tail_cache_ = tail_.load(std::memory_order_acquire);
      if (head == tail_cache_) {
        return false;
      }
    }
    LINEGATE_ASSERT_HOT(tail_cache_ - head <= slots_.size(), "the element was pushed");
    std::swap(out, slots_[head & mask_]);
    head_.store(head + 1, std::memory_order_release);
    return true;
  }

 private:
  std::vector<T> slots_;
  std::size_t mask_;

  alignas(kCacheLine) std::atomic<std::size_t> tail_{0};  // written by the producer
  std::size_t head_cache_ = 0;                            // the last head_ that the producer read
  alignas(kCacheLine) std::atomic<std::size_t> head_{0};  // written by the consumer
  std::size_t tail_cache_ = 0;                            // the last tail_ that the consumer read
};

}  // namespace linegate::exchange
