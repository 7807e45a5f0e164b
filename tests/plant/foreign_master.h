// SPDX-License-Identifier: Apache-2.0
// A flying master of another manufacturer: the states of CiA 302-2 alone, without what
// stack/nmt/README.md marks as OWN. It looks for a second master by 076h each cycle, resets all
// nodes when it becomes the active one, and starts them a second later.
#pragma once

#include <cstdint>
#include <deque>

#include "stack/base/time.h"
#include "stack/can/frame.h"

namespace linegate::plant {

class ForeignMaster {
 public:
  struct Times {
    Duration master_timeout{};
    Duration negotiation_delay{};
    Duration priority_slot{};
    Duration device_slot{};
    Duration detect_cycle{};
    Duration heartbeat{};
  };
  ForeignMaster(std::uint8_t node, std::uint8_t priority, const Times& times)
      : node_(node), priority_(priority), times_(times) {}

  void start(Instant now);
  void receive(const can::Frame& frame);
  void advance(Instant now);
  Instant next_wake() const;
  bool next_frame(can::Frame& out);

  bool is_master() const { return state_ == State::master; }
  std::uint8_t node() const { return node_; }

 private:
  enum class State : std::uint8_t { off, delay, detect, negotiate, master, slave };

  void search(bool resets, Instant now);
  void negotiate(Instant now);
  void hear_master(const can::Frame& frame);
  void hear_node_control(const can::Frame& frame);
  void time_out(Instant now);
  void indicate();

  std::uint8_t node_;
  std::uint8_t priority_;
  Times times_;
  State state_ = State::off;
  bool resets_ = false;
  std::uint8_t master_ = 0;
  Instant due_ = kNever;
  Instant beat_at_ = kNever;
  Instant master_lost_at_ = kNever;
  Instant start_nodes_at_ = kNever;
  std::deque<can::Frame> waiting_;
};

}  // namespace linegate::plant
