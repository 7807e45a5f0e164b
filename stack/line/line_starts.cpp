// What a start or stop of a node means for its outputs: the NMT command start to nodes without
// error control, and the own node.
#include <utility>

#include "stack/line/line_impl.h"
#include "stack/nmt/node_control.h"

namespace linegate::line {

[[gnu::hot]] void Line::Impl::note_start(const can::Frame& frame, std::uint64_t number) {
  if (frame.id != can::kNmtId) [[likely]] {
    return;
  }
  const auto control = nmt::decode_node_control(frame);
  if (!control || control->command != nmt::Command::start) {
    return;
  }
  for (const NodeConfig& device : config.nodes) {
    if (control->addresses(device.id)) {
      start_frames[device.id] = number;
    }
  }
}

void Line::Impl::note_lost_starts(std::uint64_t first, std::uint64_t last) {
  for (const NodeConfig& device : config.nodes) {
    std::uint64_t& number = start_frames[device.id];
    if (number < first || number > last || number == 0) {
      continue;
    }
    number = 0;
    if (!manager.node(device.id).heartbeat_monitored) {
      lost_starts.set(device.id);
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
  for (const NodeConfig& device : config.nodes) {
    const NodeState& seen = manager.node(device.id);
    if (!lost_starts[device.id]) {
      continue;
    }
    lost_starts.reset(device.id);
    receivers_changed = true;
    if (manages() && running && !seen.heartbeat_monitored &&
        seen.state == nmt::State::operational) {
      send_nmt(nmt::Command::start, device.id, now);
    }
  }
}

// What waited when it was left is gone, see pdo::Engine.
void Line::Impl::follow_own_state(Instant now) {
  const bool operational = node.state() == nmt::State::operational;
  if (std::exchange(was_operational, operational) && !operational) {
    refuse_sendings(CommandKind::mpdo_write, Refusal::wrong_state, now);
  }
}

}  // namespace linegate::line
