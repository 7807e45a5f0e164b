// SPDX-License-Identifier: Apache-2.0
#include "stack/observer/nodes.h"

#include <algorithm>

#include "stack/od/objects.h"

namespace linegate::observer {

using manager::NodeState;
using manager::Presence;

Nodes::Nodes(std::span<const manager::NodePlan> plans, std::uint8_t master, can::Dispatch& dispatch,
             EventLog& events, NodeListener& listener)
    : events_(events),
      listener_(listener),
      master_(master),
      heartbeats_(dispatch, events),
      emergencies_(dispatch, events) {
  for (std::size_t id = 0; id < nodes_.size(); ++id) {
    nodes_[id].node = static_cast<std::uint8_t>(id);
  }
  heartbeats_.set_listener(this);
  heartbeats_.listen_all(0);
  emergencies_.set_listener(this);
  emergencies_.listen_all(0);
  for (const manager::NodePlan& plan : plans) {
    nodes_[plan.id].configured = true;
    touch(plan.id);
    heartbeat_time_[plan.id] = plan.heartbeat_consumer;
    guarded_time_[plan.id] = plan.guard_time * plan.life_time_factor;
    monitor(plan.id);
  }
}

void Nodes::monitor(std::uint8_t id) {
  if (guarded_time_[id] > Duration::zero()) {
    heartbeats_.overhear_guarding(id, guarded_time_[id]);
  } else {
    heartbeats_.monitor(id, heartbeat_time_[id]);
  }
}

void Nodes::sleep() {
  asleep_ = true;
  for (std::uint8_t id = can::kMinNodeId; id <= can::kMaxNodeId; ++id) {
    heartbeats_.stop(id);
    nodes_[id].heartbeat_monitored = false;
    if (nodes_[id].presence == Presence::present) {
      touch(id);
      listener_.node_data_invalid(id);
    }
  }
}

void Nodes::fall_silent() {
  silent_ = true;
  for (std::uint8_t id = can::kMinNodeId; id <= can::kMaxNodeId; ++id) {
    if (nodes_[id].presence == Presence::present) {
      set_state(id, nmt::State::unknown);
    }
  }
}

void Nodes::wake(Instant now) {
  asleep_ = false;
  silent_ = false;
  for (std::uint8_t id = can::kMinNodeId; id <= can::kMaxNodeId; ++id) {
    if (nodes_[id].configured) {
      monitor(id);
    }
    if (nodes_[id].presence == Presence::present) {
      life_.answer(id, now);
    }
  }
  apply({.command = nmt::Command::reset_communication, .node = 0}, now);
}

Nodes::~Nodes() {
  heartbeats_.set_listener(nullptr);
  emergencies_.set_listener(nullptr);
}

void Nodes::listen_emcy(std::uint8_t node, can::CobId cob_id) {
  emergencies_.listen(node, cob_id);
}

void Nodes::advance(Instant now) {
  heartbeats_.advance(now);
  while (const std::uint8_t id = life_.pop_expired(now)) {
    if (nodes_[id].presence == Presence::present && !nodes_[id].heartbeat_monitored && !asleep_) {
      const bool is_missing = has_error_control(id) || life_.beats(id);
      miss(id, is_missing ? Presence::missing : Presence::unknown);
    }
  }
}

bool Nodes::has_error_control(std::uint8_t id) const {
  return heartbeat_time_[id] > Duration::zero() || guarded_time_[id] > Duration::zero();
}

// Values received before the node was lost are not shown.
void Nodes::miss(std::uint8_t id, Presence presence) {
  nodes_[id].presence = presence;
  nodes_[id].state = nmt::State::unknown;
  reset_[id] = false;
  life_.forget(id);
  touch(id);
  listener_.node_data_invalid(id);
}

nmt::ErrorControlReception Nodes::receive_error_control(std::uint8_t node,
                                                        const can::Frame& frame) {
  if (frame.remote()) {
    if (!asleep_) {
      heartbeats_.overhear_guarding(node, guarded_time_[node]);
    }
    return nmt::ErrorControlReception::accepted;
  }
  return heartbeats_.receive(node, frame);
}

bool Nodes::receive_emcy(std::uint8_t node, const can::Frame& frame) {
  return emergencies_.receive(node, frame);
}

void Nodes::commanded(const nmt::NodeControl& command, Instant now) {
  events_.emit({.time = now, .node = command.node, .data = event::NmtCommand{command.command}});
  apply(command, now);
}

void Nodes::apply(const nmt::NodeControl& command, Instant now) {
  changes_.commanded(command.command, command.node, now);
  shared_.begin(command.node);
  for (std::uint8_t id = can::kMinNodeId; id <= can::kMaxNodeId; ++id) {
    if (command.addresses(id)) {
      assume(id, command.command);
      if (nmt::is_reset(command.command) && id != master_) {
        listener_.node_reset(id);
      }
    }
  }
}

// Heartbeats and guard answers take precedence over commands. A reset clears the state in either
// case, and no command has an effect before the boot-up message that follows it.
void Nodes::assume(std::uint8_t id, nmt::Command command) {
  if (nodes_[id].presence != Presence::present || id == master_) {
    return;
  }
  if (nmt::is_reset(command)) {
    set_state(id, nmt::State::unknown);
    listener_.node_data_invalid(id);
    reset_[id] = true;
  } else if (!reports_state_[id] && !reset_[id]) {
    set_state(id, shown(nmt::state_after(command)));
  }
}

void Nodes::set_state(std::uint8_t id, nmt::State state) {
  if (nodes_[id].state == state) {
    return;
  }
  nodes_[id].state = state;
  touch(id);
  if (state != nmt::State::operational) {
    listener_.node_data_invalid(id);
  }
}

void Nodes::heard_pdo(std::uint8_t node, Instant now) {
  NodeState& seen = nodes_[node];
  if (reports_state_[node]) {
    return;
  }
  seen.last_heard = now;
  reset_[node] = false;
  if (!seen.configured || has_error_control(node)) {
    life_.answer(node, now);
  }
  if (seen.presence != Presence::present) {
    seen.presence = Presence::present;
    touch(node);
  }
  set_state(node, nmt::State::operational);
}

void Nodes::identity(std::uint8_t node, od::Address address, std::uint32_t value) {
  reset_[node] = false;
  NodeState& seen = nodes_[node];
  if (address == od::Address{od::objects::kDeviceType, 0}) {
    seen.device_type = value;
  } else if (address == od::objects::kVendorId) {
    seen.vendor = value;
  } else if (address == od::objects::kProductCode) {
    seen.product = value;
  } else if (address == od::objects::kRevisionNumber) {
    seen.revision = value;
  } else if (address == od::objects::kSerialNumber) {
    seen.serial = value;
  } else {
    return;
  }
  touch(node);
}

std::uint8_t Nodes::configured() const {
  return static_cast<std::uint8_t>(std::ranges::count(nodes_, true, &NodeState::configured));
}

std::uint8_t Nodes::operational() const {
  return static_cast<std::uint8_t>(std::ranges::count_if(nodes_, [](const NodeState& node) {
    return node.configured && node.presence == Presence::present &&
           node.state == nmt::State::operational;
  }));
}

std::uint64_t Nodes::heartbeats_lost() const {
  std::uint64_t lost = 0;
  for (const NodeState& node : nodes_) {
    lost += node.heartbeats_lost;
  }
  return lost;
}

// The first sign of life of a node. state: as in event::UnexpectedNode.
void Nodes::heard(std::uint8_t id, nmt::State state, Instant now) {
  NodeState& seen = nodes_[id];
  const bool first = seen.presence != Presence::present;
  seen.last_heard = now;
  reset_[id] = false;
  seen.presence = Presence::present;
  if (!seen.configured && id != master_ && (first || state == nmt::State::initialising)) {
    events_.emit({.time = now, .node = id, .data = event::UnexpectedNode{state}});
  }
}

void Nodes::changed_itself(std::uint8_t id, nmt::State state, nmt::State before, Instant now) {
  events_.emit({.time = now,
                .node = id,
                .data = event::SpontaneousChange{.state = state, .before = before}});
}

void Nodes::boot_up(std::uint8_t id, Instant now) {
  shared_.boot_up(id, now);
  if (changes_.boot_up(nodes_[id], now)) {
    changed_itself(id, nmt::State::initialising, nodes_[id].state, now);
  }
  heard(id, nmt::State::initialising, now);
  reports_state_[id] = false;
  nodes_[id].heartbeat_monitored = false;
  // A node enters it by itself right after the boot-up message
  nodes_[id].state = shown(nmt::State::pre_operational);
  listener_.node_data_invalid(id);
  listener_.node_booted(id);
  if (!nodes_[id].configured || has_error_control(id)) {
    life_.boot_up(id, now);
  }
  touch(id);
}

void Nodes::heartbeat(std::uint8_t id, nmt::State state, Instant now) {
  NodeState& seen = nodes_[id];
  const bool news =
      seen.state != shown(state) || seen.presence != Presence::present || !reports_state_[id];
  const auto twin =
      heartbeats_.guarded(id) ? event::SharedIdEvidence::none : shared_.heartbeat(id, state, now);
  if (twin != event::SharedIdEvidence::none) {
    events_.emit({.time = now, .node = id, .data = event::SharedNodeId{twin}});
  }
  const bool was_present = seen.presence == Presence::present;
  heard(id, state, now);
  if (heartbeats_.monitored(id)) {
    life_.forget(id);
  } else {
    life_.heartbeat(id, now);
  }
  if (!news) {
    return;
  }
  const nmt::State before = seen.state;
  if (was_present && changes_.shows(seen, state)) {
    changed_itself(id, state, before, now);
  }
  reports_state_[id] = true;
  seen.state = shown(state);
  seen.heartbeat_monitored = heartbeats_.monitored(id);
  touch(id);
  if (state != nmt::State::operational) {
    listener_.node_data_invalid(id);
  }
}

void Nodes::heartbeat_lost(std::uint8_t id, Instant /*deadline*/) {
  miss(id, Presence::missing);
  ++nodes_[id].heartbeats_lost;
}

void Nodes::emergency(std::uint8_t id, const emcy::Message& message, Instant now) {
  NodeState& seen = nodes_[id];
  seen.last_heard = now;
  if (seen.presence == Presence::unknown) {
    seen.presence = Presence::present;
    if (!seen.configured || has_error_control(id)) {
      life_.answer(id, now);
    }
  }
  seen.last_emcy = message.code;
  seen.error_register = message.error_register;
  ++seen.emcy_count;
  touch(id);
}

}  // namespace linegate::observer
