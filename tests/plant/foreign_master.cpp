// SPDX-License-Identifier: Apache-2.0
#include "tests/plant/foreign_master.h"

#include <algorithm>
#include <utility>

#include "stack/can/cob_id.h"

namespace linegate::plant {

void ForeignMaster::start(Instant now) {
  waiting_.push_back(can::make_frame(can::kErrorControlBase + node_, {0x00}));
  beat_at_ = now + times_.heartbeat;
  search(true, now);
}

void ForeignMaster::search(bool resets, Instant now) {
  resets_ = resets;
  state_ = State::delay;
  master_lost_at_ = kNever;
  start_nodes_at_ = kNever;
  due_ = now + times_.negotiation_delay;
}

void ForeignMaster::negotiate(Instant now) {
  search(false, now);
  state_ = State::negotiate;
  due_ = now + priority_ * times_.priority_slot + node_ * times_.device_slot;
}

void ForeignMaster::indicate() {
  waiting_.push_back(can::make_frame(0x071, {priority_, node_}));
}

void ForeignMaster::receive(const can::Frame& frame) {
  switch (frame.id) {
    case can::kNmtId:
      hear_node_control(frame);
      return;
    case 0x071:
      hear_master(frame);
      return;
    case 0x072:
      negotiate(frame.time);
      return;
    case 0x073:
      if (is_master()) {
        indicate();
      }
      return;
    case 0x075:
      waiting_.push_back(can::make_frame(0x074));
      return;
    case 0x076:
      search(false, frame.time);
      return;
    default:
      break;
  }
  const bool is_error_control =
      frame.id > can::kErrorControlBase && frame.id <= can::kErrorControlBase + can::kMaxNodeId;
  if (is_error_control && is_master() && frame.data[0] == std::byte{}) {
    indicate();
  }
  if (state_ == State::slave && frame.id == can::kErrorControlBase + master_) {
    master_lost_at_ = frame.time + 2 * times_.heartbeat;
  }
}

void ForeignMaster::hear_master(const can::Frame& frame) {
  if (state_ != State::detect && state_ != State::negotiate) {
    return;
  }
  if (std::to_integer<std::uint8_t>(frame.data[0]) <= priority_) {
    state_ = State::slave;
    master_ = std::to_integer<std::uint8_t>(frame.data[1]);
    due_ = kNever;
    master_lost_at_ = frame.time + 2 * times_.heartbeat;
    return;
  }
  waiting_.push_back(can::make_frame(0x076));
  search(false, frame.time);
}

void ForeignMaster::hear_node_control(const can::Frame& frame) {
  const bool resets = frame.data[0] == std::byte{0x81} || frame.data[0] == std::byte{0x82};
  const bool is_for_us = frame.data[1] == std::byte{} || frame.data[1] == std::byte{node_};
  if (resets && is_for_us && !is_master()) {
    waiting_.push_back(can::make_frame(can::kErrorControlBase + node_, {0x00}));
    search(false, frame.time);
  }
}

void ForeignMaster::time_out(Instant now) {
  switch (state_) {
    case State::delay:
      waiting_.push_back(can::make_frame(0x073));
      state_ = State::detect;
      due_ = now + times_.master_timeout;
      return;
    case State::detect:
      if (std::exchange(resets_, false)) {
        waiting_.push_back(can::make_frame(can::kNmtId, {0x82, 0x00}));
        search(false, now);
        return;
      }
      waiting_.push_back(can::make_frame(0x072));
      negotiate(now);
      return;
    case State::negotiate:
      indicate();
      waiting_.push_back(can::make_frame(can::kNmtId, {0x82, 0x00}));
      state_ = State::master;
      start_nodes_at_ = now + std::chrono::seconds(1);
      due_ = now + times_.detect_cycle;
      return;
    case State::master:
      waiting_.push_back(can::make_frame(0x076));
      due_ = now + times_.detect_cycle;
      return;
    case State::off:
    case State::slave:
      due_ = kNever;
      return;
  }
}

void ForeignMaster::advance(Instant now) {
  if (beat_at_ <= now) {
    beat_at_ = next_after(beat_at_, times_.heartbeat, now);
    waiting_.push_back(can::make_frame(can::kErrorControlBase + node_, {0x05}));
  }
  if (master_lost_at_ <= now) {
    search(true, now);
  }
  if (start_nodes_at_ <= now) {
    start_nodes_at_ = kNever;
    waiting_.push_back(can::make_frame(can::kNmtId, {0x01, 0x00}));
  }
  if (due_ <= now) {
    time_out(now);
  }
}

Instant ForeignMaster::next_wake() const {
  return earlier(earlier(due_, beat_at_), earlier(master_lost_at_, start_nodes_at_));
}

bool ForeignMaster::next_frame(can::Frame& out) {
  if (waiting_.empty()) {
    return false;
  }
  out = waiting_.front();
  waiting_.pop_front();
  return true;
}

}  // namespace linegate::plant
