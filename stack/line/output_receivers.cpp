// SPDX-License-Identifier: Apache-2.0
#include "stack/line/output_receivers.h"

#include <algorithm>

#include "stack/nmt/node_control.h"

namespace linegate::line {

void OutputReceivers::advance(Instant now) {
  repeat_lost_starts(now);
  follow();
}

void OutputReceivers::lost(std::uint64_t first, std::uint64_t last) {
  note_lost_ends(first, last);
  note_lost_starts(first, last);
}

// A state that was not received but assumed after a command (Manager::assume_state()) applies when
// the command was sent.
pdo::Engine::Receiver OutputReceivers::state(std::uint8_t id) const {
  using pdo::Engine;
  if (parts_.flying.is_passive()) {
    return Engine::Receiver::unlike;  // their PDOs are held back
  }
  if (host().sleeps() || host().others_sleep()) {
    return Engine::Receiver::waiting;
  }
  const NodeState& seen = parts_.manager.node(id);
  const bool operational = seen.presence == manager::Presence::present &&
                           seen.state == nmt::State::operational && !parts_.manager.held(id) &&
                           !parts_.manager.boots(id);
  if (!host().manages() && seen.presence == manager::Presence::unknown) {
    return Engine::Receiver::unheard;
  }
  if (parts_.manager.has_other_pdos(id)) {
    return Engine::Receiver::unlike;
  }
  return host().is_running() && host().usable() && operational &&
                 unconfirmed_[id].heartbeats == 0 && !lost_starts_[id] && !has_end_[id] &&
                 parts_.master.next_wake() == kNever
             ? Engine::Receiver::started
             : Engine::Receiver::waiting;
}

void OutputReceivers::commanded(nmt::Command command, std::uint8_t id) {
  forget_start_frames(id);
  follow_command(command, id);
}

// A start that was lost is not repeated after a command of another master.
void OutputReceivers::heard(nmt::Command command, std::uint8_t id) {
  for (std::uint8_t each = can::kMinNodeId; lost_starts_.any() && each <= can::kMaxNodeId; ++each) {
    if (lost_starts_[each] && (id == 0 || id == each)) {
      parts_.manager.start_dropped(each);
    }
  }
  follow_command(command, id);
}

void OutputReceivers::follow_command(nmt::Command command, std::uint8_t id) {
  forget_lost_starts(id);
  for (const NodeConfig& device : config_.nodes) {
    if (id != 0 && id != device.id) {
      continue;
    }
    if (command != nmt::Command::start) {
      expect_state(device.id);
    } else if (!parts_.manager.reports_state(device.id)) {
      unconfirmed_[device.id] = {};
    }
    changed_ = true;
  }
}

// Two heartbeats, because one that reports Operational may have been under way when the command was
// sent.
void OutputReceivers::expect_state(std::uint8_t id) {
  constexpr std::uint8_t kHeartbeats = 2;
  unconfirmed_[id] = {.heartbeats = kHeartbeats};
  invalidate(id);
}

// A controller without a bus sends its queued heartbeats all at once afterwards: several within
// half a heartbeat time count as one.
void OutputReceivers::confirm(std::uint8_t id, nmt::State state, Instant now) {
  Unconfirmed& left = unconfirmed_[id];
  if (left.heartbeats == 0) {
    return;
  }
  changed_ = true;
  if (state != nmt::State::operational) {
    left = {};
  } else if (left.heard == Instant{} || now - left.heard >= heartbeat_time(id) / 2) {
    --left.heartbeats;
    left.heard = now;
  }
}

// The configured time between two heartbeats or guard responses of a node; 0 = unknown.
Duration OutputReceivers::heartbeat_time(std::uint8_t id) const {
  const auto it = std::ranges::find(config_.nodes, id, &NodeConfig::id);
  if (it == config_.nodes.end()) {
    return {};
  }
  return it->heartbeat != Duration::zero() ? it->heartbeat : it->guard_time;
}

void OutputReceivers::invalidate(std::uint8_t id) {
  if (parts_.pdos.receiver(id) == pdo::Engine::Receiver::started) {
    parts_.pdos.set_receiver(id, pdo::Engine::Receiver::waiting);
  }
  changed_ = true;
}

void OutputReceivers::follow() {
  if (!changed_ && changes_seen_ == parts_.manager.changes()) {
    return;
  }
  changes_seen_ = parts_.manager.changes();
  changed_ = parts_.master.next_wake() != kNever;
  for (const NodeConfig& device : config_.nodes) {
    const pdo::Engine::Receiver receiver = state(device.id);
    unlike_.set(device.id, receiver == pdo::Engine::Receiver::unlike &&
                               parts_.manager.has_other_pdos(device.id));
    parts_.pdos.set_receiver(device.id, receiver);
  }
}

void OutputReceivers::note_nmt(const can::Frame& frame, std::uint64_t number) {
  const auto control = nmt::decode_node_control(frame);
  if (!control) {
    return;
  }
  const bool starts = control->command == nmt::Command::start;
  if (!starts) {
    ends_.handed_out(number, *control);
  }
  for (std::uint8_t id = can::kMinNodeId; id <= can::kMaxNodeId; ++id) {
    if (!control->addresses(id)) {
      continue;
    }
    if (starts) {
      start_frames_[id] = number;
    } else {
      newest_ends_[id] = number;
    }
    has_end_.set(id, !starts);
  }
  changed_ = true;
}

void OutputReceivers::note_acknowledged_ends(std::uint64_t number) {
  while (const auto end = ends_.take(number)) {
    note_end(*end);
  }
  for (std::uint8_t id = can::kMinNodeId; id <= can::kMaxNodeId; ++id) {
    if (has_end_[id] && newest_ends_[id] <= number) {
      has_end_.reset(id);
      changed_ = true;
    }
  }
}

// Until its acknowledgement another master may have started the node, and messages of the node may
// have shown it as Operational. A start that was ordered after the command counts with its own
// acknowledgement, unless the command is a reset and the node has not booted by then.
void OutputReceivers::note_end(const EndsUnderWay::End& end) {
  for (std::uint8_t id = can::kMinNodeId; id <= can::kMaxNodeId; ++id) {
    if (!end.control.addresses(id)) {
      continue;
    }
    const bool start_follows = parts_.manager.starts(id) || start_frames_[id] > end.number;
    expect_state(id);
    if (parts_.manager.node(id).state == nmt::State::operational) {
      parts_.manager.end_acknowledged(end.control.command, id, start_follows);
    }
  }
}

void OutputReceivers::note_lost_ends(std::uint64_t first, std::uint64_t last) {
  ends_.lost(first, last);
  for (std::uint8_t id = can::kMinNodeId; id <= can::kMaxNodeId; ++id) {
    if (has_end_[id] && newest_ends_[id] >= first && newest_ends_[id] <= last) {
      has_end_.reset(id);
      changed_ = true;
    }
  }
}

void OutputReceivers::forget_start_frames(std::uint8_t id) {
  if (id == 0) {
    start_frames_.fill(0);
  } else if (id <= can::kMaxNodeId) {
    start_frames_[id] = 0;
  }
}

void OutputReceivers::forget_lost_starts(std::uint8_t id) {
  if (id == 0) {
    lost_starts_.reset();
  } else if (id <= can::kMaxNodeId) {
    lost_starts_.reset(id);
  }
}

void OutputReceivers::note_acknowledged_starts(std::uint64_t number) {
  for (std::uint8_t id = can::kMinNodeId; id <= can::kMaxNodeId; ++id) {
    if (!parts_.manager.starts(id) || start_frames_[id] == 0 || start_frames_[id] > number) {
      continue;
    }
    parts_.manager.start_acknowledged(id);
    if (!parts_.manager.reports_state(id)) {
      unconfirmed_[id] = {};
      changed_ = true;
    }
  }
  follow();
}

void OutputReceivers::note_lost_starts(std::uint64_t first, std::uint64_t last) {
  for (std::uint8_t id = can::kMinNodeId; id <= can::kMaxNodeId; ++id) {
    std::uint64_t& number = start_frames_[id];
    if (number < first || number > last || number == 0) {
      continue;
    }
    number = 0;
    if (!parts_.manager.node(id).heartbeat_monitored) {
      lost_starts_.set(id);
      changed_ = true;
    }
  }
  if (lost_starts_.any()) {
    follow();  // before later frames are acknowledged
  }
}

void OutputReceivers::repeat_lost_starts(Instant now) {
  if (lost_starts_.none() || !host().usable()) {
    return;
  }
  for (std::uint8_t id = can::kMinNodeId; id <= can::kMaxNodeId; ++id) {
    const NodeState& seen = parts_.manager.node(id);
    if (!lost_starts_[id]) {
      continue;
    }
    lost_starts_.reset(id);
    changed_ = true;
    if (host().manages() && host().is_running() && !seen.heartbeat_monitored &&
        (seen.state == nmt::State::operational || parts_.manager.starts(id))) {
      parts_.nmt.send_nmt(nmt::Command::start, id, now);
    }
  }
}

}  // namespace linegate::line
