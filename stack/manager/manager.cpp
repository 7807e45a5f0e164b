// SPDX-License-Identifier: Apache-2.0
// Observed states and presence of the nodes; startup.cpp has the reactions.
#include "stack/manager/manager.h"

#include <algorithm>
#include <utility>

#include "stack/nmt/node_control.h"
#include "stack/od/objects.h"

namespace linegate::manager {

Manager::Manager(std::vector<NodePlan> plans, Options options, const od::Dictionary& dictionary,
                 sdo::Arbiter& sdo, nmt::HeartbeatConsumer& heartbeats, EventLog& events,
                 Host& host)
    : options_(options),
      list_(dictionary),
      heartbeats_(heartbeats),
      events_(events),
      host_(host),
      services_{list_, options.sdo_timeout, sdo, *this, heartbeats, events, host} {
  for (std::size_t id = 0; id < nodes_.size(); ++id) {
    nodes_[id].node = static_cast<std::uint8_t>(id);
  }
  slots_.reserve(plans.size());
  for (NodePlan& plan : plans) {
    slot_of(std::move(plan));
  }
  refresh_list();
}

void Manager::set_program_step(MakeStep make) {
  make_program_ = std::move(make);
  for (const auto& slot : slots_) {
    equip(*slot);
  }
}

void Manager::set_configuration_step(MakeStep make) {
  make_configuration_ = std::move(make);
  for (const auto& slot : slots_) {
    equip(*slot);
  }
}

void Manager::boot_up(std::uint8_t node, Instant now) {
  NodeState& seen = nodes_[node];
  Slot* slot = find(node);
  const bool by_program = held_[node] || (slot != nullptr && slot->boot->loads_program());
  if (causes_.boot_up(seen, now) && active() && !by_program) {
    changed_itself(node, nmt::State::initialising, seen.state, now);
  }
  seen.last_heard = now;
  seen.presence = Presence::present;
  // A node enters it by itself right after the boot-up message
  seen.state = shown(nmt::State::pre_operational);
  reset_.reset(node);
  starting_.reset(node);
  life_.boot_up(node, now);
  shared_.boot_up(node, now);
  services_.sdo.forget_producer_time(node);
  touch(node);
  if (slot == nullptr) {
    if (!held_[node]) {
      events_.emit(
          {.time = now, .node = node, .data = event::UnexpectedNode{nmt::State::initialising}});
    }
    return;
  }
  slot->boot->note_restart();
  host_.node_data_invalid(node);
  if (!active()) {
    return;
  }
  if (nodes_stopped_) {
    seen.boot = kBootUnfinished;
    seen.finding = {};
    return;
  }
  life_.forget(node);  // its boot process probes it
  heartbeats_.stop(node);
  seen.heartbeat_monitored = false;
  slot->started = false;
  slot->boot->boot_up(now);
  if (slot->boot->pauses()) {
    life_.answer(node, now);
  }
  process_boot_result(*slot, now);
  update_state(now);
}

void Manager::heartbeat(std::uint8_t node, nmt::State state, Instant now) {
  NodeState& seen = nodes_[node];
  seen.last_heard = now;
  reset_.reset(node);
  look_for_twin(node, state, now);
  if (heartbeats_.monitored(node)) {
    life_.forget(node);
  } else {
    life_.heartbeat(node, now);
  }
  Slot* slot = find(node);
  if (slot == nullptr && !held_[node] && seen.presence != Presence::present) {
    events_.emit({.time = now, .node = node, .data = event::UnexpectedNode{state}});
  }
  const nmt::State before = seen.state;
  if (before == nmt::State::operational && state != before) {
    services_.sdo.forget_producer_time(node);  // its boot-up message may have been lost
  }
  if (causes_.shows(seen, state) && active()) {
    changed_itself(node, state, before, now);
  }
  if (seen.state != shown(state) || seen.presence != Presence::present) {
    seen.state = shown(state);
    seen.presence = Presence::present;
    touch(node);
    if (state != nmt::State::operational) {
      host_.node_data_invalid(node);
    }
  }
  if (slot != nullptr) {
    if (state == nmt::State::operational) {
      end_start(*slot, now);
    }
    slot->boot->heartbeat(state, now);
    process_boot_result(*slot, now);
  }
}

// Guarded nodes are excluded: the times of their answers are those of the requests.
void Manager::look_for_twin(std::uint8_t node, nmt::State state, Instant now) {
  const auto evidence =
      heartbeats_.guarded(node)
          ? event::SharedIdEvidence::none
          : shared_.heartbeat(node, state, now, services_.sdo.producer_time(node));
  if (evidence != event::SharedIdEvidence::none) {
    events_.emit({.time = now, .node = node, .data = event::SharedNodeId{evidence}});
  }
}

void Manager::changed_itself(std::uint8_t node, nmt::State state, nmt::State before, Instant now) {
  events_.emit({.time = now,
                .node = node,
                .data = event::SpontaneousChange{.state = state, .before = before}});
}

void Manager::heartbeat_lost(std::uint8_t node, Instant now) {
  services_.sdo.forget_producer_time(node);
  miss(node, Presence::missing);
  ++nodes_[node].heartbeats_lost;
  Slot* slot = find(node);
  if (slot == nullptr || !active() || nodes_stopped_) {
    return;
  }
  if (slot->boot->heartbeat_lost(now)) {
    process_boot_result(*slot, now);
    return;
  }
  // Error event of a slave (CiA 302-2): unless all nodes are affected, it is reset, and booted
  // again as soon as it answers.
  const std::uint32_t startup = list_.startup();
  if (list_.mandatory(node) && (startup & startup::kStopAll) != 0) {
    reaction_ = Reaction::stop_all;
  } else if (list_.mandatory(node) && (startup & startup::kResetAll) != 0) {
    reaction_ = std::max(reaction_, Reaction::reset_all);
  } else {
    reset(*slot, nmt::Command::reset_node, now);
    update_state(now);
  }
}

// A node whose heartbeat returns without a boot-up message was disconnected, not reset: the reset
// sent at its loss did not reach it, so it is sent again. The reset of a node that was only late is
// still in progress.
void Manager::heartbeat_recovered(std::uint8_t node, Instant now) {
  Slot* slot = find(node);
  if (slot != nullptr && active() && !nodes_stopped_ &&
      now - slot->reset_at >= slot->plan.reset_time) {
    reset(*slot, nmt::Command::reset_communication, now);
  }
}

void Manager::consumer_lost(std::uint8_t node, Instant deadline) {
  if (nodes_[node].presence != Presence::missing) {
    heartbeats_.stop(node);  // it would report the same loss
    heartbeat_lost(node, deadline);
  }
}

void Manager::scanned(std::uint8_t node, bool answered, Instant asked_at, Instant now) {
  NodeState& seen = nodes_[node];
  if (find(node) != nullptr || held_[node] || heartbeats_.monitored(node)) {
    return;  // its boot process or its error control shows whether it is present
  }
  if (!answered) {
    if (seen.presence == Presence::present && seen.last_heard < asked_at) {
      miss(node, life_.beats(node) ? Presence::missing : Presence::unknown);
    }
    return;
  }
  reset_.reset(node);
  if (seen.presence != Presence::present) {
    seen.presence = Presence::present;
    life_.answer(node, now);
    touch(node);
  }
}

// Values received before the node was lost are not shown.
void Manager::miss(std::uint8_t node, Presence presence) {
  nodes_[node].presence = presence;
  nodes_[node].state = nmt::State::unknown;
  life_.forget(node);
  touch(node);
  host_.node_data_invalid(node);
  reset_.reset(node);
  starting_.reset(node);
}

// Nothing was received for so long that the node no longer counts as present. It is missing if it
// sent heartbeats, or its error control was started. A node without them may still be present, also
// one whose boot process ended before the start of error control: it becomes unknown.
void Manager::expire(std::uint8_t node) {
  if (nodes_[node].presence == Presence::present && !asleep_) {
    const Slot* slot = find(node);
    const bool is_missing =
        life_.beats(node) || (slot != nullptr && slot->boot->started_error_control());
    miss(node, is_missing ? Presence::missing : Presence::unknown);
  }
}

void Manager::emergency(std::uint8_t node, std::uint16_t code, std::uint8_t error_register,
                        Instant now) {
  NodeState& seen = nodes_[node];
  seen.last_heard = now;
  reset_.reset(node);
  seen.last_emcy = code;
  seen.error_register = error_register;
  ++seen.emcy_count;
  touch(node);
}

void Manager::completed(sdo::Completion& completion, Instant now) {
  Slot* slot = find(completion.node);
  if (slot == nullptr || !slot->boot->awaits(completion.number)) {
    return;  // of a boot process that was cancelled meanwhile
  }
  slot->boot->completed(completion, now);
  touch(completion.node);
  process_boot_result(*slot, now);
}

void Manager::sent(nmt::Command command, std::uint8_t node, Instant now) {
  causes_.commanded(command, node, now);
  shared_.begin(node);
  for (std::uint8_t id = can::kMinNodeId; nmt::is_reset(command) && id <= can::kMaxNodeId; ++id) {
    if (node == 0 || id == node) {
      reset_.set(id);
      starting_.reset(id);
    }
  }
}

void Manager::commanded(nmt::Command command, std::uint8_t node, Instant now,
                        std::uint32_t client) {
  if (asleep_) {
    return;
  }
  client_ = client;
  const bool ends_stop = node == 0 && command != nmt::Command::stop && leave_stop(now);
  if (nmt::is_reset(command)) {
    for (std::uint8_t id = can::kMinNodeId; id <= can::kMaxNodeId; ++id) {
      const bool reset = node == 0 || id == node;
      if (reset && find(id) == nullptr && nodes_[id].presence == Presence::present) {
        nodes_[id].state = nmt::State::unknown;
        if (!life_.holds(id)) {
          life_.answer(id, now);
        }
        touch(id);
      }
    }
  }
  for (const auto& slot : slots_) {
    const std::uint8_t id = slot->plan.id;
    if ((node != 0 && id != node) || !nodes_[id].configured) {
      continue;
    }
    if (nmt::is_reset(command)) {
      host_.node_data_invalid(id);
      heartbeats_.stop(id);
      slot->reset_at = now;
      begin(*slot, BootSlave::Reason::reset, now, command);
    } else {
      slot->boot->commanded();
      assume_state(id, command);
      if (command == nmt::Command::start) {
        expect_start(*slot, now);
      } else {
        end_start(*slot, now);
      }
    }
  }
  if (ends_stop && !nmt::is_reset(command)) {
    boot_restarted(now);
  }
  update_state(now);
  client_ = 0;
}

void Manager::hold(std::uint8_t node) {
  if (Slot* slot = find(node)) {
    slot->boot->cancel();
    slot->concluded = false;
    slot->started = false;
    slot->not_started = kNever;
    heartbeats_.stop(node);
    nodes_[node].heartbeat_monitored = false;
    nodes_[node].boot = kBootUnfinished;
    host_.node_data_invalid(node);
    touch(node);
  }
  held_.set(node);
}

void Manager::release(std::uint8_t node, Instant now, std::uint32_t client) {
  held_.reset(node);
  if (active() && find(node) != nullptr) {
    boot(node, now, client);
  }
}

void Manager::list_changed(std::uint8_t node) {
  const bool listed = list_.listed(node);
  if (nodes_[node].configured == listed) {
    return;
  }
  nodes_[node].configured = listed;
  touch(node);
  if (listed) {
    slot_of({.id = node});
    return;
  }
  for (const auto& slot : slots_) {
    if (slot->plan.id == node) {
      slot->boot->cancel();
      slot->concluded = false;
      heartbeats_.stop(node);
      nodes_[node].heartbeat_monitored = false;
    }
  }
}

bool Manager::has_error_control(std::uint8_t node) const {
  const Slot* slot = find(node);
  return slot != nullptr &&
         (slot->plan.heartbeat_consumer > Duration::zero() ||
          list_.guard_time(node) * list_.life_time_factor(node) != Duration::zero());
}

bool Manager::beats(std::uint8_t node) const {
  const Slot* slot = find(node);
  const bool is_guarded = slot != nullptr && slot->plan.heartbeat_consumer <= Duration::zero() &&
                          has_error_control(node);
  return life_.beats(node) && !is_guarded;
}

void Manager::watch(std::uint8_t node, bool wanted, Instant now) {
  const Slot* slot = find(node);
  if (slot == nullptr || asleep_) {
    return;
  }
  if (!wanted) {
    heartbeats_.stop(node);
  } else if (slot->plan.heartbeat_consumer > Duration::zero()) {
    heartbeats_.monitor(node, slot->plan.heartbeat_consumer);
  } else {
    heartbeats_.guard(node, list_.guard_time(node), list_.life_time_factor(node), now);
  }
  nodes_[node].heartbeat_monitored = heartbeats_.monitored(node);
  touch(node);
}

bool Manager::concluded(std::uint8_t id) const {
  return !nodes_[id].configured || nodes_[id].boot != kBootUnfinished;
}

bool Manager::keeps_pdos(std::uint8_t id) const {
  const Slot* slot = find(id);
  return slot != nullptr && slot->plan.boot &&
         (is_booted(nodes_[id].boot) || (slot->boot->under_way() && !slot->boot->has_ended()));
}

bool Manager::has_other_pdos(std::uint8_t id) const {
  const NodeState& node = nodes_[id];
  const Slot* slot = find(id);
  return (node.boot == 'J' && is_assumed_object(node.finding.object.index)) ||
         (slot != nullptr && active() && node.presence == Presence::present &&
          slot->boot->has_unknown_pdos());
}

bool Manager::boots(std::uint8_t id) const {
  const Slot* slot = find(id);
  return slot != nullptr && slot->boot->under_way() && !concluded(id);
}

std::uint32_t Manager::client_of(std::uint8_t id) const {
  const Slot* slot = find(id);
  return slot != nullptr ? slot->boot->client() : 0;
}

std::uint8_t Manager::configured() const {
  return static_cast<std::uint8_t>(
      std::ranges::count_if(nodes_, [](const NodeState& node) { return node.configured; }));
}

std::uint8_t Manager::operational() const {
  return static_cast<std::uint8_t>(std::ranges::count_if(nodes_, [](const NodeState& node) {
    return node.configured && node.presence == Presence::present &&
           node.state == nmt::State::operational;
  }));
}

// nullptr for a node that is not listed, or is held.
Manager::Slot* Manager::find(std::uint8_t node) const {
  if (!nodes_[node].configured || held_[node]) {
    return nullptr;
  }
  const auto slot =
      std::ranges::lower_bound(slots_, node, {}, [](const auto& each) { return each->plan.id; });
  return slot != slots_.end() && (*slot)->plan.id == node ? slot->get() : nullptr;
}

// The slot of that node; plan is used only to create it.
Manager::Slot& Manager::slot_of(NodePlan plan) {
  const auto place =
      std::ranges::lower_bound(slots_, plan.id, {}, [](const auto& each) { return each->plan.id; });
  if (place != slots_.end() && (*place)->plan.id == plan.id) {
    return **place;
  }
  auto slot = std::make_unique<Slot>();
  slot->plan = std::move(plan);  // the boot process refers to it in place
  slot->boot = std::make_unique<BootSlave>(slot->plan, services_, nodes_[slot->plan.id]);
  equip(*slot);
  return **slots_.insert(place, std::move(slot));
}

void Manager::equip(Slot& slot) {
  if (make_program_) {
    slot.boot->set_program(make_program_(slot.plan.id));
  }
  if (make_configuration_) {
    slot.boot->set_configuration(make_configuration_(slot.plan.id));
  }
}

void Manager::refresh_list() {
  for (std::uint8_t id = can::kMinNodeId; id <= can::kMaxNodeId; ++id) {
    list_changed(id);
  }
}

// Without error control no frame reports the state, so it is assumed from the command; but a node
// that was reset ignores commands before its boot-up message. A command on the bus precedes a start
// of the line that is not acknowledged yet.
void Manager::assume_state(std::uint8_t node, nmt::Command command, bool is_on_bus) {
  NodeState& seen = nodes_[node];
  if (!is_on_bus) {
    starting_.reset(node);
  }
  if (seen.heartbeat_monitored) {
    return;
  }
  if (command != nmt::Command::start) {
    host_.node_data_invalid(node);
  }
  const bool resets = nmt::is_reset(command);
  const bool before_boot_up = reset_[node] && !resets;
  if (beats(node) || seen.presence != Presence::present ||
      (before_boot_up && command == nmt::Command::start)) {
    return;
  }
  reset_.set(node, resets || before_boot_up);
  if (command == nmt::Command::start && !is_on_bus && host_.acknowledges_starts()) {
    starting_.set(node);
    return;
  }
  seen.cause = StateCause::command;
  seen.state = reset_[node] ? nmt::State::unknown : shown(nmt::state_after(command));
  touch(node);
}

void Manager::heard(nmt::Command command, std::uint8_t node) {
  for (std::uint8_t id = can::kMinNodeId; id <= can::kMaxNodeId; ++id) {
    if (node == 0 || id == node) {
      assume_state(id, command, true);
    }
  }
}

void Manager::end_acknowledged(nmt::Command command, std::uint8_t node, bool start_follows) {
  assume_state(node, command, true);
  const NodeState& seen = nodes_[node];
  starting_.set(node, start_follows && !seen.heartbeat_monitored && !beats(node) &&
                          seen.presence == Presence::present);
}

void Manager::start_acknowledged(std::uint8_t node) {
  NodeState& seen = nodes_[node];
  if (!starting_[node]) {
    return;
  }
  starting_.reset(node);
  if (!reset_[node] && !reports_state(node) && seen.presence == Presence::present) {
    seen.cause = StateCause::command;
    seen.state = shown(nmt::State::operational);
    touch(node);
  }
}

}  // namespace linegate::manager
