// SPDX-License-Identifier: Apache-2.0
// How long the library takes for the datagrams that it processes now. A datagram that makes it loop
// or wait without end never returns, and other threads may not notice that.
#pragma once

#include <algorithm>
#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>

namespace linegate::dds::guard {

class CallWatch {
 public:
  // Threads that process datagrams at the same time; further ones are not watched.
  static constexpr std::size_t kCalls = 64;
  static constexpr std::int64_t kMostExpected = 10'000'000'000;  // ns

  // A datagram is processed during the life of this object. now: in ns of any monotonic clock, not
  // 0. thread: as gettid(2). Does not allocate or wait.
  class Call {
   public:
    Call(CallWatch& watch, std::int64_t now, int thread = 0) {
      for (std::size_t i = 0; i < kCalls; ++i) {
        std::atomic<std::int64_t>& begun = watch.begun_[i];
        std::int64_t none = 0;
        if (begun.load(std::memory_order_relaxed) == 0 &&
            begun.compare_exchange_strong(none, now)) {
          watch.threads_[i].store(thread, std::memory_order_relaxed);
          begun_ = &begun;
          return;
        }
      }
    }
    ~Call() {
      if (begun_ != nullptr)
        begun_->store(0, std::memory_order_relaxed);
    }
    Call(const Call&) = delete;
    Call& operator=(const Call&) = delete;

   private:
    std::atomic<std::int64_t>* begun_ = nullptr;
  };

  // A datagram is known to occupy the library for so long, with those expected before: until then
  // nothing stalls, at most kMostExpected from now on. time: >= 0, in ns. From any thread.
  void expect(std::int64_t now, std::int64_t time) {
    std::int64_t until = expected_.load(std::memory_order_relaxed);
    while (!expected_.compare_exchange_weak(
        until, std::min(std::max(until, now) + time, now + kMostExpected))) {
    }
  }
  // Time since the expected ones should have been processed, in ns; 0: they still may be.
  std::int64_t overdue(std::int64_t now) const {
    return std::max(now - expected_.load(std::memory_order_relaxed), std::int64_t{0});
  }

  // Time since the beginning of the oldest present call, in ns, without what is expected; 0 if
  // there is none. now: of the same clock. From any thread.
  std::int64_t longest(std::int64_t now) const {
    std::int64_t out = 0;
    for (const std::atomic<std::int64_t>& begun : begun_) {
      const std::int64_t since = begun.load(std::memory_order_relaxed);
      out = since == 0 ? out : std::max(out, now - since);
    }
    return std::min(out, overdue(now));
  }
  // The thread of that call; 0 if there is none.
  int thread_of_longest(std::int64_t now) const {
    std::int64_t longest = 0;
    int out = 0;
    for (std::size_t i = 0; i < kCalls; ++i) {
      const std::int64_t since = begun_[i].load(std::memory_order_relaxed);
      if (since != 0 && now - since > longest) {
        longest = now - since;
        out = threads_[i].load(std::memory_order_relaxed);
      }
    }
    return out;
  }

 private:
  std::array<std::atomic<std::int64_t>, kCalls> begun_{};  // 0: free
  std::atomic<std::int64_t> expected_{0};
  std::array<std::atomic<int>, kCalls> threads_{};
};

}  // namespace linegate::dds::guard
