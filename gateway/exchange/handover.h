// SPDX-License-Identifier: Apache-2.0
// Passes the newest value from one thread to another, without either waiting.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>

#include "gateway/exchange/ring.h"
#include "stack/base/assert.h"

namespace linegate::exchange {

// Three buffers: the producer fills one, the consumer reads one, one is between them. The producer
// can take back and update a value that the consumer did not fetch, so that marks and counts in it
// are merged into the next value and never lost.
template <class T>
class Handover {
 public:
  Handover() = default;
  Handover(const Handover&) = delete;
  Handover& operator=(const Handover&) = delete;

  // All three buffers, to reserve memory before they are shared.
  std::array<T, 3>& buffers() { return buffers_; }

  // --- producer -------------------------------------------------------------------------------

  struct Draft {
    T& value;
    bool unread;  // value was published and not fetched: merge into it
  };
  // The buffer to fill. Until publish() the consumer cannot fetch it.
  Draft draft() {
    if ((middle_.load(std::memory_order_relaxed) & kFresh) == 0) {
      return {buffers_[back_], false};
    }
    const std::uint8_t old = middle_.exchange(back_, std::memory_order_acq_rel);
    back_ = old & kIndex;
    return {buffers_[back_], (old & kFresh) != 0};
  }
  // Makes the draft the newest value.
  void publish() {
    const auto fresh = static_cast<std::uint8_t>(back_ | kFresh);
    back_ = middle_.exchange(fresh, std::memory_order_acq_rel) & kIndex;
    LINEGATE_ASSERT_HOT(back_ != (fresh & kIndex), "each buffer has one place");
  }

  // --- consumer -------------------------------------------------------------------------------

  // Whether fetch() would return a value.
  bool fresh() const { return (middle_.load(std::memory_order_relaxed) & kFresh) != 0; }
  // The newest value if it was not fetched before, else nullptr. It does not change until the next
  // one is fetched.
  T* fetch() {
    std::uint8_t middle = middle_.load(std::memory_order_relaxed);
    while ((middle & kFresh) != 0) {
      // Fails only if the producer changed it meanwhile; the value fetched before stays unchanged.
      if (middle_.compare_exchange_weak(middle, front_, std::memory_order_acq_rel,
                                        std::memory_order_relaxed)) {
        front_ = middle & kIndex;
        return &buffers_[front_];
      }
    }
    return nullptr;
  }

 private:
  static constexpr std::uint8_t kIndex = 0x03;
  static constexpr std::uint8_t kFresh = 0x04;

  std::array<T, 3> buffers_{};
  alignas(kCacheLine) std::uint8_t back_ = 0;  // used by the producer
  alignas(kCacheLine) std::atomic<std::uint8_t> middle_{1};
  alignas(kCacheLine) std::uint8_t front_ = 2;  // used by the consumer
};

}  // namespace linegate::exchange
