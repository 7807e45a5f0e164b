// SPDX-License-Identifier: Apache-2.0
// Flying masters on one bus that is cut and joined and loses frames, in virtual time. Each has a
// heartbeat, and the active master resets the network as a manager does that boots it.
#pragma once

#include <cstdint>
#include <deque>
#include <memory>
#include <optional>
#include <random>
#include <string>
#include <vector>

#include "stack/nmt/flying_master.h"

namespace linegate::nmt {

class FlyingNetwork {
 public:
  explicit FlyingNetwork(std::uint64_t seed);
  ~FlyingNetwork();
  FlyingNetwork(const FlyingNetwork&) = delete;
  FlyingNetwork& operator=(const FlyingNetwork&) = delete;

  // Runs with faults, and then until the bound of the README has passed and two detect cycles more.
  // Returns what was wrong, empty if nothing.
  std::string run();
  // The time from the last fault on after which each part had exactly one master.
  Duration settled() const { return settled_; }
  Duration bound() const { return bound_; }

 private:
  struct Node;
  struct Sent {
    Instant at;
    const Node* from = nullptr;
    can::Frame frame;
  };

  std::uint64_t below(std::uint64_t limit) { return random_() % limit; }
  Duration between(unsigned low, unsigned high) {
    return std::chrono::milliseconds(low + below(high - low + 1));
  }
  void make_nodes();
  void send(const Node& from, const can::Frame& frame, Instant now);
  void deliver(const Sent& sent);
  void fault();
  Instant next_event() const;
  void step();
  std::string wrong() const;
  std::string describe() const;

  std::mt19937_64 random_;
  std::vector<std::unique_ptr<Node>> nodes_;
  std::deque<Sent> bus_;  // ascending by time
  Instant now_{std::chrono::seconds(1)};
  Instant next_fault_{};
  Instant faults_until_{};
  Instant last_fault_{};
  unsigned loss_ = 0;  // of 1000 frames, and of 1000 receptions
  bool keeps_alive_ = false;
  bool forces_ = false;  // MasterDetection::force
  Duration settled_{};
  Duration bound_{};
};

}  // namespace linegate::nmt
