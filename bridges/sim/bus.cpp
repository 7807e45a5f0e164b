// SPDX-License-Identifier: Apache-2.0
#include "bridges/sim/bus.h"

#include <algorithm>
#include <utility>

#include "stack/base/assert.h"
#include "stack/can/wire.h"

namespace linegate::sim {
namespace {

// Error flag, superposed flags of the others, and error delimiter (ISO 11898-1).
constexpr unsigned kErrorFrameBits = 20;

}  // namespace

Bus::Bus(const BusOptions& options) : options_(options) {
  options_.bit_rate = std::max(options_.bit_rate, 1U);
  options_.queue_depth = std::max<std::size_t>(options_.queue_depth, 1);
  options_.buffers = std::max<std::size_t>(options_.buffers, 1);
  if (options_.data_bit_rate == 0) {
    options_.data_bit_rate = options_.bit_rate;
  }
  history_.resize(std::max<std::size_t>(options_.history, 1));
}

Bus::Endpoint Bus::attach() {
  auto free = std::ranges::find_if(ends_, [](const End& end) { return !end.attached; });
  if (free == ends_.end()) {
    free = ends_.insert(ends_.end(), End{});
  }
  *free = End{};
  free->attached = true;
  free->cursor = delivered_;
  return static_cast<Endpoint>(free - ends_.begin());
}

void Bus::detach(Endpoint endpoint) {
  ends_[endpoint] = End{};
}

void Bus::set_connected(Endpoint endpoint, bool connected, Instant now) {
  End& end = ends_[endpoint];
  latest_ = std::max(latest_, now);
  if (end.connected == connected) {
    return;
  }
  end.connected = connected;
  if (connected) {
    end.cursor = delivered_;
    end.limit = kNoLimit;
    for (Waiting& waiting : end.queue) {
      // The frame cannot take part in an arbitration that already began
      waiting.submitted = latest_;
    }
  } else {
    end.limit = delivered_;
  }
}

void Bus::set_disturbance(Disturbance disturbance) {
  disturbance_ = std::move(disturbance);
}

std::size_t Bus::room(Endpoint endpoint) const {
  return options_.queue_depth - std::min(ends_[endpoint].queue.size(), options_.queue_depth);
}

bool Bus::submit(Endpoint endpoint, const can::Frame& frame, Instant now) {
  if (room(endpoint) == 0) {
    return false;
  }
  latest_ = std::max(latest_, now);
  ends_[endpoint].queue.push_back({frame, latest_, ++ends_[endpoint].submitted});
  return true;
}

std::size_t Bus::most_urgent(const End& end, Instant by) const {
  LINEGATE_ASSERT(!end.queue.empty() && end.queue.front().submitted <= by, "a frame waits");
  const std::size_t count = std::min(options_.buffers, end.queue.size());
  std::size_t best = 0;
  for (std::size_t i = 1; i < count && end.queue[i].submitted <= by; ++i) {
    if (can::wins_arbitration(end.queue[i].frame, end.queue[best].frame)) {
      best = i;
    }
  }
  return best;
}

// A frame begins when the bus is free and an endpoint has one to send. All frames submitted by then
// take part in the arbitration. It is decided only when the frame ends, so that submissions at the
// same instant need no order.
bool Bus::next_turn(Turn& turn) const {
  Instant first = kNever;
  for (const End& end : ends_) {
    if (may_send(end)) {
      first = earlier(first, end.queue.front().submitted);
    }
  }
  if (first == kNever) {
    return false;
  }
  turn.start = std::max(free_at_, first);
  const can::Frame* best = nullptr;
  for (Endpoint i = 0; i < ends_.size(); ++i) {
    if (!may_send(ends_[i]) || ends_[i].queue.front().submitted > turn.start) {
      continue;
    }
    const std::size_t place = most_urgent(ends_[i], turn.start);
    const can::Frame& frame = ends_[i].queue[place].frame;
    if (best == nullptr || can::wins_arbitration(frame, *best)) {
      best = &frame;
      turn.sender = i;
      turn.place = place;
    }
  }
  return true;
}

void Bus::advance(Instant now) {
  Turn turn;
  while (next_turn(turn)) {
    const Instant end = turn.start + time_to_last_bit(frame_of(turn));
    if (end > now) {
      break;
    }
    finish(turn, end);
  }
  latest_ = std::max(latest_, now);
}

void Bus::finish(const Turn& turn, Instant end) {
  const Endpoint sender = turn.sender;
  const can::Frame frame = frame_of(turn);
  const Fate fate = disturbance_ ? disturbance_(frame, sender) : Fate::delivered;
  const Duration intermission = can::bit_time(can::kIntermissionBits, options_.bit_rate);
  free_at_ = end + intermission;
  busy_ += time_on_wire(frame);
  if (fate == Fate::doubled) {
    ++frames_;
    deliver(sender, frame, end);
  }
  if (fate == Fate::disturbed || fate == Fate::doubled) {
    const Duration error_frame = can::bit_time(kErrorFrameBits, options_.bit_rate);
    free_at_ += error_frame;
    busy_ += error_frame;
    return;
  }
  ends_[sender].queue.erase(ends_[sender].queue.begin() + static_cast<long>(turn.place));
  ++ends_[sender].sent;
  ++frames_;
  if (fate == Fate::delivered) {
    deliver(sender, frame, end);
  }
}

void Bus::deliver(Endpoint sender, const can::Frame& frame, Instant time) {
  Delivered& slot = history_[delivered_ % history_.size()];
  slot.frame = frame;
  slot.frame.time = time;
  slot.sender = sender;
  ++delivered_;
}

Instant Bus::next_wake() const {
  Turn turn;
  if (!next_turn(turn)) {
    return kNever;
  }
  return turn.start + time_to_last_bit(frame_of(turn));
}

std::uint64_t Bus::oldest_kept() const {
  return delivered_ - std::min<std::uint64_t>(delivered_, history_.size());
}

std::uint64_t Bus::next_for(Endpoint endpoint) const {
  const End& end = ends_[endpoint];
  const std::uint64_t last = std::min(delivered_, end.limit);
  std::uint64_t number = std::max(end.cursor, std::min(oldest_kept(), last));
  while (number < last && history_[number % history_.size()].sender == endpoint) {
    ++number;
  }
  return number;
}

std::size_t Bus::take(Endpoint endpoint, std::span<can::Frame> out, Instant until) {
  End& end = ends_[endpoint];
  const std::uint64_t last = std::min(delivered_, end.limit);
  const std::uint64_t oldest = std::min(oldest_kept(), last);
  if (end.cursor < oldest) {
    end.lost += oldest - end.cursor;
  }
  std::size_t count = 0;
  while (true) {
    end.cursor = next_for(endpoint);
    if (count == out.size() || end.cursor >= last) {
      return count;
    }
    const can::Frame& frame = history_[end.cursor % history_.size()].frame;
    if (frame.time > until) {
      return count;
    }
    out[count++] = frame;
    ++end.cursor;
  }
}

Instant Bus::first_waiting(Endpoint endpoint) const {
  const std::uint64_t number = next_for(endpoint);
  if (number >= std::min(delivered_, ends_[endpoint].limit)) {
    return kNever;
  }
  return history_[number % history_.size()].frame.time;
}

std::uint64_t Bus::pop_lost(Endpoint endpoint) {
  return std::exchange(ends_[endpoint].lost, 0);
}

std::uint64_t Bus::sent(Endpoint endpoint) const {
  return ends_[endpoint].sent;
}

std::uint64_t Bus::acknowledged(Endpoint endpoint) const {
  const End& end = ends_[endpoint];
  return end.queue.empty() ? end.submitted : end.queue.front().number - 1;
}

void Bus::flush(Endpoint endpoint) {
  ends_[endpoint].queue.clear();
}

Duration Bus::time_to_last_bit(const can::Frame& frame) const {
  return can::wire_time(frame, options_.bit_rate, options_.data_bit_rate);
}

Duration Bus::time_on_wire(const can::Frame& frame) const {
  return time_to_last_bit(frame) + can::bit_time(can::kIntermissionBits, options_.bit_rate);
}

}  // namespace linegate::sim
