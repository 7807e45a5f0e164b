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
  for (std::uint8_t id = can::kMinNodeId; id <= can::kMaxNodeId; ++id) {
    if (!control->addresses(id)) {
      continue;
    }
    if (starts) {
      start_frames[id] = number;
    } else {
      ends[id] = {.number = number, .command = control->command};
    }
    has_end.set(id, !starts);
  }
  receivers_changed = true;
}

void Line::Impl::note_acknowledged_ends(std::uint64_t number) {
  for (std::uint8_t id = can::kMinNodeId; id <= can::kMaxNodeId; ++id) {
    if (!has_end[id] || ends[id].number > number) {
      continue;
    }
    has_end.reset(id);
    receivers_changed = true;
    if (manager.starts(id)) {
      continue;
    }
    expect_state(id);
    if (manager.node(id).state == nmt::State::operational) {
      manager.heard(ends[id].command, id);
    }
  }
}

void Line::Impl::note_lost_ends(std::uint64_t first, std::uint64_t last) {
  for (std::uint8_t id = can::kMinNodeId; id <= can::kMaxNodeId; ++id) {
    if (has_end[id] && ends[id].number >= first && ends[id].number <= last) {
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
