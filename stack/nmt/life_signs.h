// SPDX-License-Identifier: Apache-2.0
// How long a node counts as present after a sign of life while its error control is not monitored:
// nodes that are not configured, and configured nodes without monitoring at the moment. The period
// of heartbeats is learned from the heartbeats themselves.
#pragma once

#include <array>
#include <cstdint>

#include "stack/base/time.h"
#include "stack/can/cob_id.h"

namespace linegate::nmt {

// node is 1..127 everywhere.
class LifeSigns {
 public:
  // Hold time after a boot-up message, an answer, or a first heartbeat.
  static constexpr Duration kHold = std::chrono::seconds(10);
  // Hold time after later heartbeats: this number of learned periods, at least kShortest.
  static constexpr int kPeriods = 3;
  static constexpr Duration kShortest = std::chrono::seconds(1);

  void heartbeat(std::uint8_t node, Instant now);
  // A boot-up message: the period learned from earlier heartbeats is discarded.
  void boot_up(std::uint8_t node, Instant now);
  // Any other sign of life.
  void answer(std::uint8_t node, Instant now) { hold(node, now + kHold); }
  // A heartbeat is expected until `until`.
  void expect(std::uint8_t node, Instant until) { hold(node, until); }
  // Call it if the node's error control is monitored, or the node is known to be missing.
  void forget(std::uint8_t node) { nodes_[node].expires = kNever; }

  // Whether the node sent heartbeats since its last boot-up message.
  bool beats(std::uint8_t node) const { return nodes_[node].last != kNever; }
  bool holds(std::uint8_t node) const { return nodes_[node].expires != kNever; }

  // Returns a node whose hold time has expired, once each; 0 if there is none (left).
  std::uint8_t pop_expired(Instant now);
  // No hold time expires earlier.
  Instant next_wake() const { return next_; }

 private:
  struct Node {
    Instant last = kNever;  // time of the last heartbeat
    Duration period{};      // 0 = unknown
    Instant expires = kNever;
  };

  void hold(std::uint8_t node, Instant until);

  std::array<Node, can::kMaxNodeId + 1> nodes_{};
  Instant next_ = kNever;
};

}  // namespace linegate::nmt
