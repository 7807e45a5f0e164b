// SPDX-License-Identifier: Apache-2.0
// A bounded queue of messages between one producing and one consuming process, in memory that both
// can write.
//
// Neither end trusts the other: each keeps its own position, reads a word of the other end once per
// use and checks it, and the consumer copies a message before anything reads it. An end that finds
// an impossible value reports `broken` and never accesses memory outside the ring.
//
// Layout of the memory: ByteRingHeader, then a power of two of bytes. A message is its length in 4
// bytes, its bytes, and padding to a multiple of 8; it may continue at the start of the bytes.
#pragma once

#include <algorithm>
#include <atomic>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <vector>

#include "gateway/exchange/ring.h"
#include "stack/base/assert.h"

namespace linegate::exchange {

struct ByteRingHeader {
  alignas(kCacheLine) std::atomic<std::uint64_t> tail{0};  // bytes ever written, by the producer
  alignas(kCacheLine) std::atomic<std::uint64_t> head{0};  // bytes ever read, by the consumer
  // 1: the consumer is about to wait, and must be woken after the next message.
  alignas(kCacheLine) std::atomic<std::uint32_t> waiting{0};
};
static_assert(std::atomic<std::uint64_t>::is_always_lock_free);

// What both ends need to access the bytes.
class ByteRingMemory {
 public:
  // bytes: a power of two, at least 64. Both must outlive this object.
  ByteRingMemory(ByteRingHeader& header, std::span<std::byte> bytes)
      : header_(&header), bytes_(bytes) {
    LINEGATE_ASSERT(std::has_single_bit(bytes.size()) && bytes.size() >= 64,
                    "a ring has a power of two of bytes");
  }

  // The longest message: half of the ring, so that a full ring never excludes a message for good.
  std::size_t longest() const { return bytes_.size() / 2 - kLengthBytes; }

 protected:
  static constexpr std::size_t kLengthBytes = 4;

  static std::uint64_t places(std::size_t length) { return (kLengthBytes + length + 7) / 8 * 8; }

  void put(std::uint64_t position, std::span<const std::byte> from) {
    const std::size_t start = position & (bytes_.size() - 1);
    const std::size_t first = std::min(from.size(), bytes_.size() - start);
    std::memcpy(bytes_.data() + start, from.data(), first);
    std::memcpy(bytes_.data(), from.data() + first, from.size() - first);
  }
  void get(std::uint64_t position, std::span<std::byte> to) const {
    const std::size_t start = position & (bytes_.size() - 1);
    const std::size_t first = std::min(to.size(), bytes_.size() - start);
    std::memcpy(to.data(), bytes_.data() + start, first);
    std::memcpy(to.data() + first, bytes_.data(), to.size() - first);
  }

  ByteRingHeader* header_;
  std::span<std::byte> bytes_;
};

class ByteRingProducer : public ByteRingMemory {
 public:
  using ByteRingMemory::ByteRingMemory;

  // Returns false if there is no room, the message is empty or longer than longest(), or the ring
  // is broken.
  bool push(std::span<const std::byte> message) {
    if (message.empty() || message.size() > longest() ||
        tail_ - consumed() + places(message.size()) > bytes_.size() || broken_) {
      return false;
    }
    const auto length = static_cast<std::uint32_t>(message.size());
    put(tail_, std::as_bytes(std::span(&length, 1)));
    put(tail_ + kLengthBytes, message);
    tail_ += places(message.size());
    header_->tail.store(tail_, std::memory_order_release);
    return true;
  }

  // Whether the consumer waits and must be woken. Call it after push().
  bool pop_waiting() {
    std::atomic_thread_fence(std::memory_order_seq_cst);
    return header_->waiting.load(std::memory_order_relaxed) != 0 &&
           header_->waiting.exchange(0, std::memory_order_relaxed) != 0;
  }

  // Position behind the last message.
  std::uint64_t position() const { return tail_; }
  // Position up to which the consumer has removed messages; never decreases.
  std::uint64_t consumed() {
    const std::uint64_t head = header_->head.load(std::memory_order_acquire);
    if (head - head_ > tail_ - head_) {
      broken_ = true;
    } else {
      head_ = head;
    }
    return head_;
  }
  // The consumer has reported an impossible position: no more messages are accepted.
  bool broken() const { return broken_; }

 private:
  std::uint64_t tail_ = 0;
  std::uint64_t head_ = 0;  // the last valid position that the consumer reported
  bool broken_ = false;
};

class ByteRingConsumer : public ByteRingMemory {
 public:
  using ByteRingMemory::ByteRingMemory;

  // Copies the oldest message, which stays in the ring until pop(). Returns false if there is none,
  // or the ring is broken.
  bool front(std::vector<std::byte>& message) {
    const std::uint64_t filled = header_->tail.load(std::memory_order_acquire) - head_;
    if (filled == 0 || broken_) {
      return false;
    }
    std::uint32_t length = 0;
    if (filled <= bytes_.size() && filled >= 8) {
      get(head_, std::as_writable_bytes(std::span(&length, 1)));
      // The length that is checked is the one that is used: never read again.
      std::atomic_signal_fence(std::memory_order_seq_cst);
    }
    if (length == 0 || length > longest() || places(length) > filled) {
      broken_ = true;
      return false;
    }
    message.resize(length);
    get(head_ + kLengthBytes, message);
    next_ = head_ + places(length);
    return true;
  }
  // Removes the message that front() copied.
  void pop() {
    head_ = next_;
    header_->head.store(head_, std::memory_order_release);
  }

  // Call it before waiting. Returns false if a message has arrived: do not wait.
  bool prepare_wait() {
    header_->waiting.store(1, std::memory_order_relaxed);
    std::atomic_thread_fence(std::memory_order_seq_cst);
    return header_->tail.load(std::memory_order_relaxed) == head_;
  }

  // The producer has written an impossible position or length: no more messages are read.
  bool broken() const { return broken_; }

 private:
  std::uint64_t head_ = 0;
  std::uint64_t next_ = 0;
  bool broken_ = false;
};

}  // namespace linegate::exchange
