// SPDX-License-Identifier: Apache-2.0
// What is received of other nodes: error control, NMT commands.
#include "stack/line/line_impl.h"
#include "stack/nmt/node_control.h"

namespace linegate::line {

// Out of the state fatal error there is but this way.
void Line::Impl::begin_anew(nmt::Command command, Instant now) {
  node.command(command, now);
  manager.start(now);
}

void Line::Impl::consumer_lost(std::uint8_t id, Instant deadline) {
  manager.consumer_lost(id, deadline);
}

void Line::Impl::boot_up(std::uint8_t id, Instant now) {
  confirm(id, nmt::State::initialising, now);
  lss.boot_up(id);
  manager.boot_up(id, now);
  scanning.boot_up(id, now);
}

void Line::Impl::heartbeat(std::uint8_t id, nmt::State state, Instant now) {
  confirm(id, state, now);
  lss.heartbeat(id);
  diagnosing.diagnosis().heard(id, state, now);
  manager.heartbeat(id, state, now);
  records.heartbeat(id, now);
}

void Line::Impl::heartbeat_lost(std::uint8_t id, Instant deadline) {
  manager.heartbeat_lost(id, deadline);
}

void Line::Impl::heartbeat_recovered(std::uint8_t id, Instant now) {
  manager.heartbeat_recovered(id, now);
}

// Commands of another master, or of the master while the own node is NMT slave.
void Line::Impl::hear_nmt(std::uint16_t index, const can::Frame& frame) {
  diagnosing.nmt_received(index, frame);
  const auto control = index == 0 ? nmt::decode_node_control(frame) : std::nullopt;
  if (control) {
    manager.sent(control->command, control->node, frame.time);
    if (frame.id == can::kNmtId) {
      note_command(control->command, control->node);
      manager.heard(control->command, control->node);
    }
  }
}

void Line::Impl::node_data_invalid(std::uint8_t id) {
  diagnosing.diagnosis().states_changed();
  image.set_node_valid(id, false);
  node.pdos().drop_waiting(id);
  outputs_invalid(id);
}

}  // namespace linegate::line
