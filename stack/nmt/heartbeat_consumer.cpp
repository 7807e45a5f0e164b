// SPDX-License-Identifier: Apache-2.0
#include "stack/nmt/heartbeat_consumer.h"

#include <algorithm>
#include <optional>
#include <utility>

#include "stack/base/assert.h"
#include "stack/base/time.h"

namespace linegate::nmt {
namespace {

// Bit 7 is the toggle bit of node guarding and 0 in heartbeats, so a state with bit 7 is reserved.
std::optional<State> decode_state(const can::Frame& frame) {
  const auto state = static_cast<State>(frame.data[0]);
  switch (state) {
    case State::initialising:
    case State::stopped:
    case State::operational:
    case State::pre_operational:
      return frame.length == 1 ? std::optional(state) : std::nullopt;
    case State::unknown:
      break;
  }
  return std::nullopt;
}

// An answer to node guarding, or a boot-up message. A node in Initialising does not answer.
bool is_guard_answer(const can::Frame& frame) {
  can::Frame without_toggle = frame;
  without_toggle.data[0] &= ~kToggleBit;
  return frame.data[0] != kToggleBit && decode_state(without_toggle).has_value();
}

}  // namespace

void HeartbeatListener::boot_up(std::uint8_t /*node*/, Instant /*now*/) {
}
void HeartbeatListener::heartbeat(std::uint8_t /*node*/, State /*state*/, Instant /*now*/) {
}
void HeartbeatListener::heartbeat_lost(std::uint8_t /*node*/, Instant /*deadline*/) {
}
void HeartbeatListener::heartbeat_recovered(std::uint8_t /*node*/, Instant /*now*/) {
}

HeartbeatConsumer::HeartbeatConsumer(can::Dispatch& dispatch, EventLog& events, std::uint16_t mark,
                                     can::TransmitQueue* transmit)
    : dispatch_(dispatch), events_(events), mark_(mark), transmit_(transmit) {
}

HeartbeatConsumer::~HeartbeatConsumer() {
  for (std::uint8_t id = can::kMinNodeId; id <= can::kMaxNodeId; ++id) {
    ignore(id);
  }
}

void HeartbeatConsumer::listen(std::uint8_t node) {
  if (exists(node) && !std::exchange(nodes_[node].listening, true)) {
    dispatch_.add(can::kErrorControlBase + node, false, can::Service::error_control,
                  static_cast<std::uint16_t>(mark_ | node));
  }
}

void HeartbeatConsumer::listen_all(std::uint8_t own) {
  for (std::uint8_t id = can::kMinNodeId; id <= can::kMaxNodeId; ++id) {
    if (id != own) {
      listen(id);
    }
  }
}

void HeartbeatConsumer::ignore(std::uint8_t node) {
  if (exists(node) && nodes_[node].listening) {
    dispatch_.remove(can::kErrorControlBase + node, false, can::Service::error_control,
                     static_cast<std::uint16_t>(mark_ | node));
    stop(node);
    nodes_[node] = Node{};
    next_is_stale_ = true;
  }
}

void HeartbeatConsumer::monitor(std::uint8_t node, Duration time) {
  if (!exists(node)) {
    return;
  }
  if (time <= Duration::zero()) {
    stop(node);
    return;
  }
  stop(node);
  listen(node);
  nodes_[node].time = time;
}

void HeartbeatConsumer::guard(std::uint8_t node, Duration guard_time, std::uint8_t life_time_factor,
                              Instant now) {
  if (!exists(node)) {
    return;
  }
  stop(node);
  const Duration life_time = guard_time * life_time_factor;
  if (transmit_ == nullptr || life_time <= Duration::zero()) {
    return;
  }
  listen(node);
  nodes_[node].time = life_time;
  nodes_[node].guard = {.time = guard_time, .next = now};
  set_deadline(nodes_[node], now + life_time);
  ++guarded_;
  request(now);
}

void HeartbeatConsumer::overhear_guarding(std::uint8_t node, Duration life_time) {
  if (!exists(node) || nodes_[node].guard.by_others) {
    return;
  }
  const std::optional<std::byte> toggle = nodes_[node].guard.toggle;  // of own requests
  stop(node);
  listen(node);
  nodes_[node].time = life_time;
  nodes_[node].guard.toggle = toggle;
  nodes_[node].guard.by_others = true;
}

void HeartbeatConsumer::ask(std::uint8_t node) {
  if (exists(node) && transmit_ != nullptr) {
    listen(node);
    nodes_[node].asked = transmit_->push(can::TransmitClass::error_control, guard_request(node));
    if (nodes_[node].guard.by_others) {
      nodes_[node].guard.toggle.reset();
    }
  }
}

void HeartbeatConsumer::stop(std::uint8_t node) {
  if (exists(node)) {
    nodes_[node].time = Duration::zero();
    nodes_[node].lost = false;
    set_deadline(nodes_[node], kNever);
    LINEGATE_ASSERT(guarded_ > 0 || !nodes_[node].guard.asks(), "a guarded node is counted");
    guarded_ -= nodes_[node].guard.asks() ? 1U : 0U;
    nodes_[node].guard = Guard{};
  }
}

ErrorControlReception HeartbeatConsumer::receive(std::uint8_t node, const can::Frame& frame) {
  if (exists(node) && nodes_[node].guard.active()) {
    can::Frame answer = frame;
    if (!is_guard_answer(frame)) {
      return ErrorControlReception::malformed;
    }
    return nodes_[node].guard.accept_toggle(answer) ? take(node, answer)
                                                    : ErrorControlReception::not_alternated;
  }
  if (exists(node) && std::exchange(nodes_[node].asked, false)) {
    can::Frame answer = frame;
    answer.data[0] &= ~kToggleBit;
    return take(node, answer);
  }
  return take(node, frame);
}

ErrorControlReception HeartbeatConsumer::take(std::uint8_t node, const can::Frame& frame) {
  const std::optional<State> state = decode_state(frame);
  if (!state) {
    return ErrorControlReception::malformed;
  }
  if (!exists(node)) {
    return ErrorControlReception::accepted;
  }
  if (frame.time > nodes_[node].deadline) {
    lose(node);
  }
  if (*state == State::initialising) {
    receive_boot_up(node, frame.time);
  } else {
    receive_heartbeat(node, *state, frame.time);
  }
  return ErrorControlReception::accepted;
}

void HeartbeatConsumer::advance(Instant now) {
  while (next_deadline() <= now) {
    // In the order of the deadlines, not of the node-IDs.
    const auto first = std::ranges::min_element(nodes_, {}, &Node::deadline);
    lose(static_cast<std::uint8_t>(first - nodes_.begin()));
  }
  if (next_request_ <= now) {
    request(now);
  }
}

Instant HeartbeatConsumer::next_wake() const {
  return earlier(next_deadline(), next_request_);
}

Instant HeartbeatConsumer::next_deadline() const {
  if (next_is_stale_) {
    next_ = std::ranges::min_element(nodes_, {}, &Node::deadline)->deadline;
    next_is_stale_ = false;
  }
  return next_;
}

State HeartbeatConsumer::state(std::uint8_t node) const {
  return exists(node) ? nodes_[node].state : State::unknown;
}

bool HeartbeatConsumer::monitored(std::uint8_t node) const {
  return exists(node) && nodes_[node].time > Duration::zero();
}

bool HeartbeatConsumer::guarded(std::uint8_t node) const {
  return exists(node) && nodes_[node].guard.active();
}

bool HeartbeatConsumer::lost(std::uint8_t node) const {
  return exists(node) && nodes_[node].lost;
}

Duration HeartbeatConsumer::time(std::uint8_t node) const {
  return exists(node) ? nodes_[node].time : Duration::zero();
}

void HeartbeatConsumer::lose(std::uint8_t id) {
  Node& node = nodes_[id];
  LINEGATE_ASSERT(node.deadline != kNever && node.time > Duration::zero(),
                  "only a node that is monitored is lost");
  const Instant deadline = node.deadline;
  set_deadline(node, kNever);
  node.lost = true;
  events_.emit({.time = deadline,
                .node = id,
                .data = event::HeartbeatLost{
                    .by = node.guard.active() ? event::ErrorControl::node_guarding
                                              : event::ErrorControl::heartbeat,
                    .time = std::chrono::duration_cast<std::chrono::milliseconds>(node.time)}});
  if (listener_ != nullptr) {
    listener_->heartbeat_lost(id, deadline);
  }
}

void HeartbeatConsumer::recover(std::uint8_t id, State state, Instant now) {
  nodes_[id].lost = false;
  events_.emit({.time = now, .node = id, .data = event::HeartbeatRecovered{state}});
  if (listener_ != nullptr) {
    listener_->heartbeat_recovered(id, now);
  }
}

void HeartbeatConsumer::receive_boot_up(std::uint8_t id, Instant now) {
  // The node enters Pre-operational by itself. It may have lost its producer heartbeat time, so the
  // next heartbeat has no deadline. A guarded node is requested, so it keeps its deadline.
  nodes_[id].state = State::pre_operational;
  set_deadline(nodes_[id], nodes_[id].guard.asks() ? now + nodes_[id].time : kNever);
  if (emits_states_) {
    events_.emit({.time = now, .node = id, .data = event::BootUp{}});
  }
  if (listener_ != nullptr) {
    listener_->boot_up(id, now);
  }
}

void HeartbeatConsumer::receive_heartbeat(std::uint8_t id, State state, Instant now) {
  Node& node = nodes_[id];
  if (node.time > Duration::zero()) {
    set_deadline(node, now + node.time);
  }
  if (node.lost) {
    recover(id, state, now);
  }
  if (node.state != state) {
    const State before = std::exchange(node.state, state);
    if (emits_states_) {
      events_.emit(
          {.time = now, .node = id, .data = event::NodeState{.state = state, .before = before}});
    }
  }
  if (listener_ != nullptr) {
    listener_->heartbeat(id, state, now);
  }
}

// The period does not drift, and missed requests are skipped. The number of requests in the
// transmit queue is limited.
void HeartbeatConsumer::request(Instant now) {
  next_request_ = kNever;
  for (std::uint8_t id = can::kMinNodeId; guarded_ > 0 && id <= can::kMaxNodeId; ++id) {
    Guard& guard = nodes_[id].guard;
    if (guard.asks() && guard.next <= now) {
      guard.next = next_after(guard.next, guard.time, now);
      if (transmit_->queued(can::TransmitClass::error_control) < guarded_) {
        transmit_->push(can::TransmitClass::error_control, guard_request(id));
      }
    }
    next_request_ = earlier(next_request_, guard.next);
  }
}

void HeartbeatConsumer::set_deadline(Node& node, Instant deadline) {
  node.deadline = deadline;
  next_is_stale_ = true;
}

}  // namespace linegate::nmt
