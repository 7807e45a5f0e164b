#include "stack/manager/manager.h"

#include <algorithm>
#include <utility>

namespace linegate::manager {

Manager::Manager(std::vector<NodePlan> plans, Options options, sdo::Arbiter& sdo,
                 nmt::HeartbeatConsumer& heartbeats, EventLog& events, Host& host)
    : options_(options), sdo_(sdo), heartbeats_(heartbeats), events_(events), host_(host) {
  for (std::size_t id = 0; id < nodes_.size(); ++id) {
    nodes_[id].node = static_cast<std::uint8_t>(id);
  }
  slots_.reserve(plans.size());  // the boot processes refer to the plans in place
  for (NodePlan& plan : plans) {
    Slot& slot = slots_.emplace_back(Slot{.plan = std::move(plan)});
    NodeState& node = nodes_[slot.plan.id];
    node.configured = true;
    slot.boot = std::make_unique<BootSlave>(slot.plan, options_.sdo_timeout, sdo_, heartbeats_,
                                            events_, node);
  }
}

void Manager::start(Instant now) {
  if (options_.reset_nodes) {
    host_.send_nmt(nmt::Command::reset_communication, 0);
    set_state(ManagerState::resetting, now);
  } else {
    set_state(ManagerState::booting, now);
  }
  for (Slot& slot : slots_) {
    slot.reset_at = now;
    begin(slot, now, options_.reset_nodes);
  }
  if (slots_.empty()) {
    update_state(now);
  }
  release_own_node(now);
}

void Manager::stop(Instant now) {
  for (Slot& slot : slots_) {
    slot.boot->cancel();
    heartbeats_.stop(slot.plan.id);
    host_.node_data_invalid(slot.plan.id);
  }
  set_state(ManagerState::stopped, now);
}

void Manager::boot_up(std::uint8_t node, Instant now) {
  NodeState& seen = nodes_[node];
  seen.last_heard = now;
  seen.presence = Presence::present;
  seen.state = nmt::State::pre_operational;  // entered by itself right after the boot-up message
  touch(node);
  Slot* slot = find(node);
  if (slot == nullptr) {
    events_.emit({.time = now, .kind = EventKind::unexpected_node, .node = node, .code = 0});
    return;
  }
  host_.node_data_invalid(node);
  if (!active()) {
    return;
  }
  heartbeats_.stop(node);
  begin(*slot, now, false);
  update_state(now);
}

void Manager::heartbeat(std::uint8_t node, nmt::State state, Instant now) {
  NodeState& seen = nodes_[node];
  seen.last_heard = now;
  Slot* slot = find(node);
  if (slot == nullptr && seen.presence == Presence::unknown) {
    events_.emit({.time = now,
                  .kind = EventKind::unexpected_node,
                  .node = node,
                  .code = static_cast<std::uint8_t>(state)});
  }
  if (seen.state != state || seen.presence != Presence::present) {
    seen.state = state;
    seen.presence = Presence::present;
    touch(node);
    if (state != nmt::State::operational) {
      host_.node_data_invalid(node);
    }
  }
  if (slot != nullptr) {
    slot->boot->heartbeat(now);
    settle(*slot, now);
  }
}

void Manager::heartbeat_lost(std::uint8_t node, Instant now) {
  NodeState& seen = nodes_[node];
  seen.presence = Presence::missing;
  ++seen.heartbeats_lost;
  touch(node);
  host_.node_data_invalid(node);
  // Error event of a slave (CiA 302-2): reset it and boot it again, as soon as it answers.
  if (Slot* slot = find(node); slot != nullptr && active()) {
    reset(*slot, nmt::Command::reset_node, now);
    update_state(now);
  }
}

// A node that speaks again without a boot-up message was not reset, only cut off: the reset sent at
// the loss did not reach it, so it is sent again. One that was only late has it on its way.
void Manager::heartbeat_recovered(std::uint8_t node, Instant now) {
  Slot* slot = find(node);
  if (slot != nullptr && active() && now - slot->reset_at >= kResetWait) {
    reset(*slot, nmt::Command::reset_communication, now);
  }
}

void Manager::emergency(std::uint8_t node, std::uint16_t code, std::uint8_t error_register,
                        Instant now) {
  NodeState& seen = nodes_[node];
  seen.last_heard = now;
  seen.last_emcy = code;
  seen.error_register = error_register;
  ++seen.emcy_count;
  touch(node);
}

void Manager::completed(const sdo::Completion& completion, Instant now) {
  Slot* slot = find(completion.node);
  if (slot == nullptr || !slot->boot->owns(completion.token)) {
    return;  // of a boot process that was given up meanwhile
  }
  slot->boot->completed(completion, now);
  touch(completion.node);
  settle(*slot, now);
}

void Manager::commanded(nmt::Command command, std::uint8_t node, Instant now) {
  const bool reset =
      command == nmt::Command::reset_node || command == nmt::Command::reset_communication;
  for (Slot& slot : slots_) {
    if (node != 0 && slot.plan.id != node) {
      continue;
    }
    if (reset) {
      host_.node_data_invalid(slot.plan.id);
      heartbeats_.stop(slot.plan.id);
      slot.reset_at = now;
      begin(slot, now, true);
    } else {
      assume_state(slot.plan.id, command);
    }
  }
  update_state(now);
}

void Manager::advance(Instant now) {
  for (Slot& slot : slots_) {
    if (slot.boot->next_wake() <= now) {
      slot.boot->advance(now);
      settle(slot, now);
      update_state(now);
    }
  }
}

Instant Manager::next_wake() const {
  Instant wake = kNever;
  for (const Slot& slot : slots_) {
    wake = earlier(wake, slot.boot->next_wake());
  }
  return wake;
}

std::uint8_t Manager::operational() const {
  return static_cast<std::uint8_t>(std::ranges::count_if(slots_, [this](const Slot& slot) {
    const NodeState& node = nodes_[slot.plan.id];
    return node.presence == Presence::present && node.state == nmt::State::operational;
  }));
}

Manager::Slot* Manager::find(std::uint8_t node) {
  const auto it =
      std::ranges::lower_bound(slots_, node, {}, [](const Slot& s) { return s.plan.id; });
  return it != slots_.end() && it->plan.id == node ? &*it : nullptr;
}

void Manager::begin(Slot& slot, Instant now, bool expect_boot_up) {
  nodes_[slot.plan.id].heartbeat_monitored = false;
  slot.boot->begin(now, expect_boot_up);
  touch(slot.plan.id);
}

void Manager::reset(Slot& slot, nmt::Command command, Instant now) {
  host_.send_nmt(command, slot.plan.id);
  slot.reset_at = now;
  begin(slot, now, true);
}

// Takes up what the boot process of a node has come to.
void Manager::settle(Slot& slot, Instant now) {
  const std::optional<char> result = slot.boot->take_result();
  if (!result) {
    return;
  }
  slot.concluded = true;
  touch(slot.plan.id);
  if (*result == kBooted && options_.start_nodes) {
    start_node(slot.plan.id);
  }
  update_state(now);
}

void Manager::start_node(std::uint8_t node) {
  host_.send_nmt(nmt::Command::start, node);
  assume_state(node, nmt::Command::start);
}

// Without error control nobody will tell the state, so the command has to stand for it.
void Manager::assume_state(std::uint8_t node, nmt::Command command) {
  NodeState& seen = nodes_[node];
  if (seen.heartbeat_monitored) {
    return;
  }
  switch (command) {
    case nmt::Command::start:
      seen.state = nmt::State::operational;
      break;
    case nmt::Command::stop:
      seen.state = nmt::State::stopped;
      host_.node_data_invalid(node);
      break;
    case nmt::Command::enter_pre_operational:
      seen.state = nmt::State::pre_operational;
      host_.node_data_invalid(node);
      break;
    case nmt::Command::reset_node:
    case nmt::Command::reset_communication:
      break;
  }
  touch(node);
}

void Manager::release_own_node(Instant now) {
  const bool booted = std::ranges::all_of(slots_, [this](const Slot& slot) {
    return !slot.plan.mandatory || nodes_[slot.plan.id].boot == kBooted;
  });
  if (booted && !std::exchange(released_, true)) {
    host_.may_operate(now);
  }
}

void Manager::update_state(Instant now) {
  if (!active()) {
    return;
  }
  release_own_node(now);
  const bool missing = std::ranges::any_of(slots_, [this](const Slot& slot) {
    return slot.plan.mandatory && slot.concluded && nodes_[slot.plan.id].boot != kBooted;
  });
  const bool all_concluded = std::ranges::all_of(slots_, &Slot::concluded);
  set_state(missing         ? ManagerState::missing_mandatory
            : all_concluded ? ManagerState::running
                            : ManagerState::booting,
            now);
}

void Manager::set_state(ManagerState state, Instant now) {
  const ManagerState before = std::exchange(state_, state);
  if (before != state) {
    events_.emit({.time = now,
                  .kind = EventKind::manager_state,
                  .code = static_cast<std::uint8_t>(state),
                  .value = static_cast<std::uint8_t>(before)});
  }
}

}  // namespace linegate::manager
