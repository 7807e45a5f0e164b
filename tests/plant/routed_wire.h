// SPDX-License-Identifier: Apache-2.0
// The bus of a network in the routed world.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <map>
#include <random>
#include <vector>

#include "stack/base/time.h"
#include "stack/can/frame.h"

namespace linegate::plant {

// A bus whose frames all take the same time, which is fast to simulate: of the first frames of all
// ends the one with the lowest identifier is sent next.
class Wire {
 public:
  static constexpr Duration kFrameTime = std::chrono::microseconds(128);
  static constexpr std::size_t kDepth = 8;

  std::size_t attach() {
    ends_.emplace_back();
    return ends_.size() - 1;
  }
  std::size_t room(std::size_t end) const { return kDepth - ends_[end].out.size(); }
  void submit(std::size_t end, const can::Frame& frame, Instant now) {
    ends_[end].out.push_back(frame);
    begin(now);
  }
  void advance(Instant now) {
    while (busy_ && until_ <= now) {
      busy_ = false;
      can::Frame frame = ends_[sender_].out.front();
      ends_[sender_].out.pop_front();
      frame.time = until_;
      ++carried_[frame.id];
      const bool lost = loss_ != 0 && chance_() % 1'000'000 < loss_;
      for (std::size_t end = 0; end < ends_.size(); ++end) {
        if (end != sender_ && !lost) {
          ends_[end].in.push_back(frame);
        }
      }
      begin(until_);
    }
  }
  Instant next_wake() const { return busy_ ? until_ : kNever; }
  void lose(std::uint32_t of_a_million, std::uint64_t seed) {
    loss_ = of_a_million;
    chance_.seed(seed);
  }
  std::uint64_t carried(std::uint32_t id, std::uint32_t mask) const {
    std::uint64_t out = 0;
    for (const auto& [each, count] : carried_) {
      out += (each & mask) == id ? count : 0;
    }
    return out;
  }
  bool take(std::size_t end, can::Frame& out) {
    if (ends_[end].in.empty()) {
      return false;
    }
    out = ends_[end].in.front();
    ends_[end].in.pop_front();
    return true;
  }

 private:
  struct End {
    std::deque<can::Frame> out;
    std::deque<can::Frame> in;
  };

  void begin(Instant now) {
    if (busy_) {
      return;
    }
    for (std::size_t end = 0; end < ends_.size(); ++end) {
      if (!ends_[end].out.empty() &&
          (!busy_ || ends_[end].out.front().id < ends_[sender_].out.front().id)) {
        sender_ = end;
        busy_ = true;
      }
    }
    until_ = now + kFrameTime;
  }

  std::vector<End> ends_;
  std::map<std::uint32_t, std::uint64_t> carried_;  // number of frames, by identifier
  std::uint32_t loss_ = 0;
  std::mt19937_64 chance_;
  std::size_t sender_ = 0;
  bool busy_ = false;
  Instant until_{};
};

}  // namespace linegate::plant
