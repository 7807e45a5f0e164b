// SPDX-License-Identifier: Apache-2.0
// The newest value of something, from one thread to another, without either ever waiting.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>

#include "gateway/exchange/ring.h"
#include "stack/base/assert.h"

namespace linegate::exchange {

// Three buffers: one the producer fills, one the consumer reads, one between them. A value the
// consumer did not fetch can be taken back by the producer and brought up to date, so that what is
// marked in it (changes, counts) is merged into the next and never lost.
template <class T>
class Handover {
 public:
  Handover() = default;
  Handover(const Handover&) = delete;
  Handover& operator=(const Handover&) = delete;

  // Before they are shared: all three buffers, to reserve what they will need.
  std::array<T, 3>& buffers() { return buffers_; }

  // --- producer -------------------------------------------------------------------------------

  struct Draft {
    T& value;
    bool unread;  // value was published, and nobody has seen it: merge into it
  };
  // The buffer to fill. Until publish() the consumer finds nothing new.
  Draft draft() {
    if ((middle_.load(std::memory_order_relaxed) & kFresh) == 0) {
      return {buffers_[back_], false};
    }
    const std::uint8_t old = middle_.exchange(back_, std::memory_order_acq_rel);
    back_ = old & kIndex;
    return {buffers_[back_], (old & kFresh) != 0};
  }
  // What draft() gave becomes the newest value.
  void publish() {
    const auto fresh = static_cast<std::uint8_t>(back_ | kFresh);
    back_ = middle_.exchange(fresh, std::memory_order_acq_rel) & kIndex;
    LINEGATE_ASSERT_HOT(back_ != (fresh & kIndex), "each buffer has one place");
  }

  // --- consumer -------------------------------------------------------------------------------

  // The newest value if there is one that was not fetched before, else nullptr. It stays as it is
  // until the next one is fetched.
  T* fetch() {
    std::uint8_t middle = middle_.load(std::memory_order_relaxed);
    while ((middle & kFresh) != 0) {
      // Fails only when the producer did something meanwhile; what was fetched before is not
      // touched then.
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
  alignas(kCacheLine) std::uint8_t back_ = 0;  // the producer's
  alignas(kCacheLine) std::atomic<std::uint8_t> middle_{1};
  alignas(kCacheLine) std::uint8_t front_ = 2;  // the consumer's
};

}  // namespace linegate::exchange
