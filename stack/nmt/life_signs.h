// SPDX-License-Identifier: Apache-2.0
// How long a node counts as present after a sign of life while no error control of it is monitored:
// nodes that are not configured, and configured ones that nobody monitors at the moment. The time
// between two heartbeats is learned from the heartbeats themselves.
#pragma once

#include <array>
#include <cstdint>

#include "stack/base/time.h"
#include "stack/can/cob_id.h"

namespace linegate::nmt {

// node is 1..127 everywhere.
class LifeSigns {
 public:
  // After a boot-up message, an answer, or a first heartbeat.
  static constexpr Duration kHold = std::chrono::seconds(10);
  // After later heartbeats: this many of the times learned, at least kShortest.
  static constexpr int kPeriods = 3;
  static constexpr Duration kShortest = std::chrono::seconds(1);

  void heartbeat(std::uint8_t node, Instant now);
  // Its boot-up message: the heartbeats before it belong to another life.
  void boot_up(std::uint8_t node, Instant now);
  // Any other sign of life.
  void answer(std::uint8_t node, Instant now) { hold(node, now + kHold); }
  // A heartbeat is expected until then.
  void expect(std::uint8_t node, Instant until) { hold(node, until); }
  // Its error control is monitored, or it is known to be missing.
  void forget(std::uint8_t node) { nodes_[node].expires = kNever; }

  // It sent heartbeats since its last boot-up message.
  bool beats(std::uint8_t node) const { return nodes_[node].last != kNever; }
  bool holds(std::uint8_t node) const { return nodes_[node].expires != kNever; }

  // A node whose time is over, once; 0 if there is none (any more).
  std::uint8_t take_expired(Instant now);
  // No node's time is over before.
  Instant next_wake() const { return next_; }

 private:
  struct Node {
    Instant last = kNever;  // heartbeat
    Duration period{};      // 0 = not known
    Instant expires = kNever;
  };

  void hold(std::uint8_t node, Instant until);

  std::array<Node, can::kMaxNodeId + 1> nodes_{};
  Instant next_ = kNever;
};

}  // namespace linegate::nmt
