// SPDX-License-Identifier: Apache-2.0
// Single values that one thread writes and others read.
#pragma once

#include <atomic>
#include <cstdint>

#include "gateway/exchange/ring.h"

namespace linegate::exchange {

// A request to a thread, such as to stop.
class Flag {
 public:
  void raise() { raised_.store(true, std::memory_order_release); }
  bool raised() const { return raised_.load(std::memory_order_acquire); }
  // Call it before the thread that reads it is started again.
  void lower() { raised_.store(false, std::memory_order_release); }

 private:
  alignas(kCacheLine) std::atomic<bool> raised_{false};
};

// A counter of one thread that others may read. It never decreases.
class Counter {
 public:
  // Only for its one writer.
  void add(std::uint64_t n = 1) {
    value_.store(value_.load(std::memory_order_relaxed) + n, std::memory_order_relaxed);
  }
  std::uint64_t value() const { return value_.load(std::memory_order_relaxed); }

 private:
  alignas(kCacheLine) std::atomic<std::uint64_t> value_{0};
};

}  // namespace linegate::exchange
