// SPDX-License-Identifier: Apache-2.0
// The start-up of the network (CiA 302-2): which nodes are reset, booted and started, and when; and
// the reaction to the loss of a mandatory node.
#include <algorithm>
#include <string_view>
#include <utility>

#include "stack/manager/boot_event.h"
#include "stack/manager/manager.h"

namespace linegate::manager {

void Manager::start(Instant now) {
  if (asleep_) {
    return;
  }
  const bool reset = options_.reset_nodes;
  leave_stop(now);
  refresh_list();
  set_state(reset ? ManagerState::resetting : ManagerState::booting, now);
  if (reset) {
    reset_nodes(now);
  }
  boot_all(now);
}

// If no node is to be kept alive, all are reset with one command, otherwise the others one by one.
void Manager::reset_nodes(Instant now) {
  constexpr auto kCommand = nmt::Command::reset_communication;
  const auto kept = [this](const auto& slot) {
    return list_.has(slot->plan.id, assignment::kListed | assignment::kKeepAlive);
  };
  if (std::ranges::none_of(slots_, kept)) {
    host_.send_nmt(kCommand, 0, now);
    services_.sdo.charge(client_, 1);
    return;
  }
  for (const auto& slot : slots_) {
    if (nodes_[slot->plan.id].configured && !kept(slot)) {
      host_.send_nmt(kCommand, slot->plan.id, now);
      services_.sdo.charge(client_, 1);
    }
  }
}

// The nodes that are not to be kept alive have just been reset.
void Manager::boot_all(Instant now) {
  released_ = false;
  all_started_ = false;
  time_is_over_ = false;
  reaction_ = Reaction::none;
  const Duration boot_time = list_.boot_time();
  boot_deadline_ = boot_time > Duration::zero() ? now + boot_time : kNever;
  for (const auto& slot : slots_) {
    slot->concluded = false;
    nodes_[slot->plan.id].boot = kBootUnfinished;
  }
  for (const auto& slot : slots_) {
    if (!nodes_[slot->plan.id].configured) {
      continue;
    }
    slot->reset_at = now;
    heartbeats_.stop(slot->plan.id);
    const bool was_reset =
        options_.reset_nodes && !list_.has(slot->plan.id, assignment::kKeepAlive);
    begin(*slot, was_reset ? BootSlave::Reason::reset : BootSlave::Reason::present, now);
  }
  if (configured() == 0) {
    update_state(now);
  }
  release(now);
}

void Manager::stop(Instant now) {
  end(now, false);
  set_state(ManagerState::stopped, now);
}

void Manager::sleep(Instant now) {
  if (active()) {
    stop(now);
  }
  asleep_ = true;
}

void Manager::fall_silent() {
  silent_ = true;
  for (std::uint8_t node = can::kMinNodeId; node <= can::kMaxNodeId; ++node) {
    if (nodes_[node].presence == Presence::present && nodes_[node].state != nmt::State::unknown) {
      nodes_[node].state = nmt::State::unknown;
      touch(node);
    }
  }
}

// A node that does not return by itself becomes missing, or unknown, as usual. The states before
// the sleep have ended.
void Manager::wake(Instant now) {
  asleep_ = false;
  silent_ = false;
  for (std::uint8_t node = can::kMinNodeId; node <= can::kMaxNodeId; ++node) {
    if (nodes_[node].presence == Presence::present) {
      nodes_[node].state = nmt::State::unknown;
      life_.answer(node, now);
      touch(node);
      host_.node_data_invalid(node);
    }
  }
  sent(nmt::Command::reset_communication, 0, now);
}

void Manager::hand_over(Instant now, bool keeps_data) {
  end(now, keeps_data);
  set_state(ManagerState::inactive, now);
}

// Nodes whose heartbeat is no longer monitored count as present until the next one is late.
void Manager::end(Instant now, bool keeps_data) {
  for (const auto& slot : slots_) {
    slot->boot->cancel();
    slot->not_started = kNever;
    leave_error_control(*slot);
    const NodeState& seen = nodes_[slot->plan.id];
    if (!keeps_data || seen.presence != Presence::present ||
        seen.state != nmt::State::operational) {
      host_.node_data_invalid(slot->plan.id);
    }
    nodes_[slot->plan.id].heartbeat_monitored = false;
    leave_unwatched(*slot, now);
    touch(slot->plan.id);
  }
  starting_.reset();
  boot_deadline_ = kNever;
  reaction_ = Reaction::none;
  nodes_stopped_ = false;
}

// A guarded node is still observed, because its answers carry the toggle bit: to requests in
// progress, and to those of another master.
void Manager::leave_error_control(const Slot& slot) {
  const std::uint8_t id = slot.plan.id;
  if (slot.plan.heartbeat_consumer <= Duration::zero() && has_error_control(id)) {
    heartbeats_.overhear_guarding(id, Duration::zero());
  } else {
    heartbeats_.stop(id);
  }
}

// From now on neither a boot process nor error control shows whether the node is present.
void Manager::leave_unwatched(const Slot& slot, Instant now) {
  if (heartbeats_.monitored(slot.plan.id)) {
    return;
  }
  if (!slot.boot->started_error_control()) {
    life_.answer(slot.plan.id, now);
  } else if (slot.plan.heartbeat_consumer > Duration::zero()) {
    life_.expect(slot.plan.id, now + slot.plan.heartbeat_consumer);
  } else if (has_error_control(slot.plan.id)) {
    life_.answer(slot.plan.id, now);
  }
}

void Manager::boot(std::uint8_t node, Instant now, std::uint32_t client) {
  if (asleep_) {
    return;
  }
  if (node == 0) {
    client_ = client;
    start(now);
    client_ = 0;
    return;
  }
  Slot* slot = find(node);
  if (slot == nullptr) {
    if (nodes_[node].presence != Presence::unknown) {
      nodes_[node].boot = 'A';
      nodes_[node].finding = {};
      touch(node);
    }
    events_.emit(boot_result(node, 'A', {}, now));
    return;
  }
  client_ = client;
  const bool ends_stop = leave_stop(now);
  boot_again(*slot, now);
  if (ends_stop) {
    boot_restarted(now);
  }
  update_state(now);
  client_ = 0;
}

void Manager::boot_again(Slot& slot, Instant now) {
  const std::uint8_t id = slot.plan.id;
  heartbeats_.stop(id);
  if (list_.has(id, assignment::kKeepAlive)) {
    begin(slot, BootSlave::Reason::present, now);
  } else {
    host_.node_data_invalid(id);
    reset(slot, nmt::Command::reset_communication, now);
  }
}

void Manager::advance(Instant now) {
  while (const std::uint8_t node = life_.pop_expired(now)) {
    expire(node);
  }
  if (reaction_ != Reaction::none) {
    react(now);
  }
  if (boot_deadline_ <= now) {
    boot_deadline_ = kNever;
    time_is_over_ = !mandatory_booted();
    update_state(now);
  }
  for (const auto& slot : slots_) {
    if (slot->not_started <= now) {
      miss_start(*slot, now);
    }
    if (slot->boot->next_wake() <= now) {
      slot->boot->advance(now);
      process_boot_result(*slot, now);
      update_state(now);
    }
  }
}

Instant Manager::next_wake() const {
  if (reaction_ != Reaction::none) {
    return Instant{};
  }
  Instant wake = earlier(boot_deadline_, life_.next_wake());
  for (const auto& slot : slots_) {
    wake = earlier(wake, earlier(slot->boot->next_wake(), slot->not_started));
  }
  return wake;
}

void Manager::begin(Slot& slot, BootSlave::Reason reason, Instant now, nmt::Command command) {
  if (held_[slot.plan.id]) {
    return;
  }
  nodes_[slot.plan.id].heartbeat_monitored = false;
  slot.started = false;
  slot.not_started = kNever;
  slot.boot->set_client(client_);
  slot.boot->begin(reason, now, command);
  touch(slot.plan.id);
  process_boot_result(slot, now);
}

void Manager::reset(Slot& slot, nmt::Command command, Instant now) {
  host_.send_nmt(command, slot.plan.id, now);
  services_.sdo.charge(client_, 1);
  slot.reset_at = now;
  begin(slot, BootSlave::Reason::reset, now, command);
}

// Processes the result of the boot process of a node.
void Manager::process_boot_result(Slot& slot, Instant now) {
  const std::optional<char> result = slot.boot->pop_result();
  if (!result) {
    return;
  }
  slot.concluded = true;
  if (*result != 'B') {
    reset_.reset(slot.plan.id);  // the node answered
  }
  slot.started = *result == kWasOperational;
  if (!is_booted(*result) && !slot.boot->searching() && !life_.holds(slot.plan.id)) {
    life_.answer(slot.plan.id, now);  // no process probes it any more
  }
  touch(slot.plan.id);
  update_state(now);
  slot.boot->set_client(0);  // a process that goes on searches for the node, which nobody requested
}

// --- starting nodes -----------------------------------------------------------------------------

// According to 1F80h: each node at the end of its boot process; or all together when the last boot
// process has ended, and later ones each at the end of their boot process.
void Manager::start_nodes(Instant now) {
  const std::uint32_t startup = list_.startup();
  if ((startup & startup::kSlavesNotStarted) != 0) {
    return;
  }
  if ((startup & startup::kStartAll) != 0 && !all_started_) {
    const auto is = [this](bool Slot::*what) {
      return std::ranges::all_of(slots_, [&](const auto& slot) {
        return !nodes_[slot->plan.id].configured || (*slot).*what;
      });
    };
    if (!released_ || !is(&Slot::concluded)) {
      return;
    }
    all_started_ = true;
    const bool all = std::ranges::all_of(slots_, [this](const auto& slot) {
      return !nodes_[slot->plan.id].configured || may_start(*slot);
    });
    if (all && !slots_.empty()) {
      host_.send_nmt(nmt::Command::start, 0, now);
      services_.sdo.charge(client_, 1);
      for (const auto& slot : slots_) {
        slot->started = true;
        slot->boot->commanded();
        assume_state(slot->plan.id, nmt::Command::start);
        expect_start(*slot, now);
      }
    }
  }
  for (const auto& slot : slots_) {
    if (!slot->started && may_start(*slot)) {
      start_node(*slot, now);
    }
  }
}

bool Manager::may_start(const Slot& slot) const {
  const std::uint8_t id = slot.plan.id;
  return nodes_[id].configured && is_booted(nodes_[id].boot) && list_.has(id, assignment::kBoot);
}

void Manager::start_node(Slot& slot, Instant now) {
  slot.started = true;
  host_.send_nmt(nmt::Command::start, slot.plan.id, now);
  services_.sdo.charge(slot.boot->client(), 1);
  assume_state(slot.plan.id, nmt::Command::start);
  expect_start(slot, now);
}

// The error control of the node shows whether the command took effect.
void Manager::expect_start(Slot& slot, Instant now) {
  constexpr Duration kShortest = std::chrono::seconds(1);
  const std::uint8_t id = slot.plan.id;
  const Duration life_time = list_.guard_time(id) * list_.life_time_factor(id);
  if (nodes_[id].heartbeat_monitored && nodes_[id].state != nmt::State::operational) {
    slot.not_started = now + std::max({slot.plan.heartbeat_consumer, life_time, kShortest});
  }
}

void Manager::end_start(Slot& slot, Instant now) {
  const std::uint8_t id = slot.plan.id;
  slot.not_started = kNever;
  if (nodes_[id].boot == kNotStarted) {
    nodes_[id].boot = kBooted;
    touch(id);
    events_.emit(boot_result(id, kBooted, {}, now));
  }
}

void Manager::miss_start(Slot& slot, Instant now) {
  const std::uint8_t id = slot.plan.id;
  slot.not_started = kNever;
  if (nodes_[id].boot == kBooted && nodes_[id].presence == Presence::present &&
      nodes_[id].state != nmt::State::operational) {
    nodes_[id].boot = kNotStarted;
    touch(id);
    events_.emit(boot_result(id, kNotStarted, {}, now));
  }
}

// --- error events -------------------------------------------------------------------------------

void Manager::own_reset(std::uint32_t client) {
  if (active() && reaction_ < Reaction::restart) {
    reaction_ = Reaction::restart;
    reaction_client_ = client;
  }
}

void Manager::react(Instant now) {
  const Reaction reaction = std::exchange(reaction_, Reaction::none);
  const std::uint32_t client = std::exchange(reaction_client_, 0);
  if (reaction == Reaction::stop_all) {
    stop_all(now);
    return;
  }
  if (reaction == Reaction::restart) {
    boot(0, now, client);
    return;
  }
  for (const auto& slot : slots_) {
    heartbeats_.stop(slot->plan.id);
    host_.node_data_invalid(slot->plan.id);
  }
  host_.send_nmt(nmt::Command::reset_node, 0, now);
  host_.command_own(nmt::Command::reset_communication, now);
  refresh_list();
  set_state(ManagerState::resetting, now);
  boot_all(now);
}

// A start, a boot or an NMT command ends the stop: the own node serves SDOs again. Returns true if
// there was one.
bool Manager::leave_stop(Instant now) {
  const bool stopped = std::exchange(nodes_stopped_, false);
  if (stopped) {
    released_ = false;
    host_.command_own(nmt::Command::enter_pre_operational, now);
  }
  return stopped;
}

// Nodes that restarted in the stop, or whose boot process it ended, do not have their
// configuration.
void Manager::boot_restarted(Instant now) {
  for (const auto& slot : slots_) {
    if (find(slot->plan.id) != nullptr && slot->boot->has_unknown_pdos() &&
        !slot->boot->under_way()) {
      boot_again(*slot, now);
    }
  }
}

void Manager::stop_all(Instant now) {
  nodes_stopped_ = true;
  host_.send_nmt(nmt::Command::stop, 0, now);
  host_.command_own(nmt::Command::stop, now);
  for (const auto& slot : slots_) {
    slot->boot->cancel();
    slot->not_started = kNever;
    leave_unwatched(*slot, now);
    host_.node_data_invalid(slot->plan.id);
    if (nodes_[slot->plan.id].configured) {
      assume_state(slot->plan.id, nmt::Command::stop);
    }
  }
  update_state(now);
}

// --- the state of the whole ---------------------------------------------------------------------

bool Manager::mandatory_booted() const {
  return std::ranges::all_of(slots_, [this](const auto& slot) {
    return !list_.mandatory(slot->plan.id) || is_booted(nodes_[slot->plan.id].boot);
  });
}

// A wrong device, or one that cannot be given its configuration or program: waiting does not help.
bool Manager::failed_for_good(const Slot& slot) const {
  const char letter = nodes_[slot.plan.id].boot;
  const bool identity = std::string_view("CDMNO").find(letter) != std::string_view::npos;
  if (identity && nodes_[slot.plan.id].finding.kind != BootFinding::Kind::value) {
    return false;  // it could not be read
  }
  return list_.mandatory(slot.plan.id) && slot.concluded && !is_booted(letter) &&
         letter != kBootUnfinished && letter != kNoErrorControl && !slot.boot->searching();
}

// Once all mandatory nodes are booted, the own node may become Operational.
void Manager::release(Instant now) {
  if (released_ || !mandatory_booted()) {
    return;
  }
  released_ = true;
  boot_deadline_ = kNever;
  time_is_over_ = false;
  if ((list_.startup() & startup::kApplicationStarts) == 0) {
    host_.mandatory_nodes_booted(now);
  }
}

void Manager::update_state(Instant now) {
  if (!active()) {
    return;
  }
  if (!nodes_stopped_) {
    release(now);
  }
  const bool halted =
      nodes_stopped_ ||
      (!released_ && (time_is_over_ || std::ranges::any_of(slots_, [this](const auto& slot) {
                        return failed_for_good(*slot);
                      })));
  if (halted) {
    set_state(ManagerState::halted, now);
    return;
  }
  bool missing = false;
  bool all_concluded = true;
  for (const auto& slot : slots_) {
    const std::uint8_t id = slot->plan.id;
    missing |= list_.mandatory(id) && slot->concluded && !is_booted(nodes_[id].boot);
    all_concluded &= slot->concluded || !nodes_[id].configured;
  }
  set_state(missing         ? ManagerState::missing_mandatory
            : all_concluded ? ManagerState::running
                            : ManagerState::booting,
            now);
  start_nodes(now);
}

void Manager::set_state(ManagerState state, Instant now) {
  const ManagerState before = std::exchange(state_, state);
  if (before != state) {
    events_.emit({.time = now, .data = event::ManagerState{.state = state, .before = before}});
  }
}

}  // namespace linegate::manager
