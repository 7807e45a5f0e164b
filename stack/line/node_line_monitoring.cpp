// SPDX-License-Identifier: Apache-2.0
// Reception from other nodes: error control, NMT commands.
#include "stack/line/node_line.h"
#include "stack/nmt/node_control.h"

namespace linegate::line {

void NodeLine::consumer_lost(std::uint8_t id, Instant deadline) {
  manager_.consumer_lost(id, deadline);
  services_.flying.heartbeat_lost(id, deadline);
}

void NodeLine::boot_up(std::uint8_t id, Instant now) {
  sdo_.charge(services_.scan.restarts(id) ? services_.scan.client() : manager_.client_of(id), 1);
  services_.receivers.confirm(id, nmt::State::initialising, now);
  services_.lss.boot_up(id);
  loader_.boot_up(id);
  manager_.boot_up(id, now);
  services_.scan.boot_up(id, now);
  services_.connections.boot_up(id, now);
  services_.flying.boot_up(now);
}

void NodeLine::heartbeat(std::uint8_t id, nmt::State state, Instant now) {
  services_.receivers.confirm(id, state, now);
  services_.lss.heartbeat(id);
  services_.diagnosis.diagnosis().heard(id, state, now);
  services_.flying.heartbeat(id, now);
  manager_.heartbeat(id, state, now);
  services_.records.heartbeat(id, now);
}

void NodeLine::heartbeat_lost(std::uint8_t id, Instant deadline) {
  manager_.heartbeat_lost(id, deadline);
  services_.flying.heartbeat_lost(id, deadline);
}

void NodeLine::heartbeat_recovered(std::uint8_t id, Instant now) {
  manager_.heartbeat_recovered(id, now);
  services_.connections.heartbeat_recovered(id, now);
}

// Commands of another master, or of the master while the own node is an NMT slave.
void NodeLine::hear_nmt(const can::Target& target, const can::Frame& frame) {
  if (target.index != 0 && services_.flying.competes()) {
    if (!services_.flying.receive(frame)) {
      ++counters_.frames_malformed;
      events_.emit(can::malformed_event(frame));
    }
    return;
  }
  services_.diagnosis.nmt_received(target.index, frame);
  const auto control = target.index == 0 ? nmt::decode_node_control(frame) : std::nullopt;
  if (control) {
    manager_.sent(control->command, control->node, frame.time);
    if (frame.id == can::kNmtId) {
      services_.lss.commanded(control->command, control->node);
      services_.receivers.heard(control->command, control->node);
      manager_.heard(control->command, control->node);
      services_.flying.hear(*control, frame.time);
    }
  }
}

void NodeLine::node_data_invalid(std::uint8_t id) {
  services_.diagnosis.diagnosis().states_changed();
  image_.set_node_valid(id, false);
  node_.pdos().drop_waiting(id);
  services_.receivers.invalidate(id);
  services_.srdos.forget(id);
}

}  // namespace linegate::line
