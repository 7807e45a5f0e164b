// SPDX-License-Identifier: Apache-2.0
// Shared by the parts of routing in one line: the queue to other lines, the report of refusals, and
// a queue of frames.
#pragma once

#include <algorithm>
#include <array>
#include <bitset>
#include <cstddef>
#include <cstdint>
#include <span>

#include "stack/base/assert.h"
#include "stack/base/event_log.h"
#include "stack/routing/config.h"
#include "stack/routing/message.h"
#include "stack/routing/sdo_indication.h"

namespace linegate::routing {

// Messages to other lines, and to the line itself, for clients of this process whose target is on
// the same line.
class Post {
 public:
  Post(std::uint8_t interface, MessageQueue& out) : interface_(interface), out_(out) {}

  // Interfaces that are ways over other gateways: their messages stay in the line, for
  // GatewayEgress.
  void set_ways(std::span<const Interface> interfaces) {
    ways_.reset();
    for (const Interface& each : interfaces) {
      ways_.set(each.number, each.way != nullptr);
    }
  }

  // False if there is no room: the message was not sent.
  bool send(Message message) {
    message.from = interface_;
    const bool stays = message.to == interface_ || ways_.test(message.to);
    return stays ? loop_.push(message) : out_.push(message);
  }
  // To the line itself, from the way with that number.
  bool send_from(std::uint8_t way, Message message) {
    message.from = way;
    return loop_.push(message);
  }
  // Removes the oldest message to the line itself; false if there is none.
  bool take(Message& out) { return loop_.pop(out); }

 private:
  std::uint8_t interface_;
  std::bitset<256> ways_;
  MessageQueue& out_;
  MessageQueue loop_{512};
};

inline Message to_connection(MessageKind kind, std::uint8_t to, std::uint32_t connection,
                             std::uint64_t word) {
  Message out{.to = to, .kind = kind, .connection = connection};
  store_le(out.data.data(), word);
  return out;
}
inline std::uint64_t word_of(const Message& message) {
  return load_le<std::uint64_t>(message.data.data());
}

enum class RoutedService : std::uint8_t { sdo, emcy, pdo };

inline void report_refused(EventLog& events, RoutedService service, std::uint16_t source,
                           const Indication& target, AbortCode why, Instant now) {
  events.emit({.time = now,
               .data = event::RoutingRefused{.abort = why,
                                             .source = source,
                                             .target = target.network,
                                             .target_node = target.node,
                                             .service = service}});
}

// Frames that wait for a bus: at most one sub-block, which arrives as fast as the other bus carries
// it.
class WordQueue {
 public:
  static constexpr std::size_t kCapacity = 127;
  static constexpr Duration kRetry = std::chrono::milliseconds(1);

  bool push(std::uint64_t word) {
    if (count_ == kCapacity) {
      return false;
    }
    words_[(first_ + count_++) % kCapacity] = word;
    return true;
  }
  bool empty() const { return count_ == 0; }
  // Precondition: !empty().
  std::uint64_t front() const {
    LINEGATE_ASSERT_HOT(!empty(), "a word waits");
    return words_[first_];
  }
  // Precondition: !empty().
  void pop() {
    LINEGATE_ASSERT_HOT(!empty(), "a word waits");
    first_ = (first_ + 1) % kCapacity;
    --count_;
  }
  std::size_t size() const { return count_; }
  void clear() { count_ = 0; }

 private:
  std::array<std::uint64_t, kCapacity> words_;
  std::size_t first_ = 0;
  std::size_t count_ = 0;
};

}  // namespace linegate::routing
