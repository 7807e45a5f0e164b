// SPDX-License-Identifier: Apache-2.0
// What a start or stop of a node means for its outputs: NMT commands on their way to the bus, and
// the own node.
#include <utility>

#include "stack/line/line_impl.h"
#include "stack/nmt/node_control.h"

namespace linegate::line {

[[gnu::hot]] void Line::Impl::note_nmt(const can::Frame& frame, std::uint64_t number) {
  if (frame.id != can::kNmtId) [[likely]] {
    return;
  }
  const auto control = nmt::decode_node_control(frame);
  if (!control) {
    return;
  }
  const bool starts = control->command == nmt::Command::start;
  if (!starts) {
    ends.handed_out(number, *control);
  }
  for (std::uint8_t id = can::kMinNodeId; id <= can::kMaxNodeId; ++id) {
    if (!control->addresses(id)) {
      continue;
    }
    if (starts) {
      start_frames[id] = number;
    } else {
      newest_ends[id] = number;
    }
    has_end.set(id, !starts);
  }
  receivers_changed = true;
}

void Line::Impl::note_acknowledged_ends(std::uint64_t number) {
  while (const auto control = ends.take(number)) {
    note_end(*control);
  }
  for (std::uint8_t id = can::kMinNodeId; id <= can::kMaxNodeId; ++id) {
    if (has_end[id] && newest_ends[id] <= number) {
      has_end.reset(id);
      receivers_changed = true;
    }
  }
}

// What follows may be another command that ends Operational. A start shows the state itself.
void Line::Impl::note_end(const nmt::NodeControl& control) {
  for (std::uint8_t id = can::kMinNodeId; id <= can::kMaxNodeId; ++id) {
    if (!has_end[id] || !control.addresses(id) || manager.starts(id)) {
      continue;
    }
    expect_state(id);
    if (manager.node(id).state == nmt::State::operational) {
      manager.heard(control.command, id);
    }
  }
}

void Line::Impl::note_lost_ends(std::uint64_t first, std::uint64_t last) {
  ends.lost(first, last);
  for (std::uint8_t id = can::kMinNodeId; id <= can::kMaxNodeId; ++id) {
    if (has_end[id] && newest_ends[id] >= first && newest_ends[id] <= last) {
      has_end.reset(id);
      receivers_changed = true;
    }
  }
}

void Line::Impl::forget_starts(std::uint8_t id) {
  if (id == 0) {
    start_frames.fill(0);
    lost_starts.reset();
  } else if (id <= can::kMaxNodeId) {
    start_frames[id] = 0;
    lost_starts.reset(id);
  }
}

void Line::Impl::note_acknowledged_starts(std::uint64_t number) {
  for (std::uint8_t id = can::kMinNodeId; id <= can::kMaxNodeId; ++id) {
    if (start_frames[id] != 0 && start_frames[id] <= number) {
      manager.start_acknowledged(id);
    }
  }
  follow_receivers();
}

void Line::Impl::note_lost_starts(std::uint64_t first, std::uint64_t last) {
  for (std::uint8_t id = can::kMinNodeId; id <= can::kMaxNodeId; ++id) {
    std::uint64_t& number = start_frames[id];
    if (number < first || number > last || number == 0) {
      continue;
    }
    number = 0;
    if (!manager.node(id).heartbeat_monitored) {
      lost_starts.set(id);
      receivers_changed = true;
    }
  }
  if (lost_starts.any()) {
    follow_receivers();  // before later frames are acknowledged
  }
}

void Line::Impl::repeat_lost_starts(Instant now) {
  if (lost_starts.none() || !usable()) {
    return;
  }
  for (std::uint8_t id = can::kMinNodeId; id <= can::kMaxNodeId; ++id) {
    const NodeState& seen = manager.node(id);
    if (!lost_starts[id]) {
      continue;
    }
    lost_starts.reset(id);
    receivers_changed = true;
    if (manages() && running && !seen.heartbeat_monitored &&
        (seen.state == nmt::State::operational || manager.starts(id))) {
      send_nmt(nmt::Command::start, id, now);
    }
  }
}

// What waited when it was left is gone, see pdo::Engine.
void Line::Impl::follow_own_state(Instant now) {
  const std::uint64_t starts = node.counters().starts;
  const bool is_new = std::exchange(own_starts, starts) != starts;
  if (is_new || node.state() != nmt::State::operational) {
    refuse_sendings(CommandKind::mpdo_write, Refusal::wrong_state, now);
  }
}

}  // namespace linegate::line
