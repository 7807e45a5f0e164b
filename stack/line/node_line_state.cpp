// SPDX-License-Identifier: Apache-2.0
// The state and the counters of a line with its own node.
#include "stack/line/node_line.h"

namespace linegate::line {

LineState NodeLine::do_state() const {
  LineState out;
  out.role = role();
  out.node_id = config_.node_id;
  out.network_id = config_.network_id;
  out.own_state = node_.state();
  out.indicators = node_.indicators();
  out.manager = manager_.state();
  out.network = services_.diagnosis.diagnosis().network_state();
  out.bus = bus_;
  out.transmit_errors = transmit_errors_;
  out.receive_errors = receive_errors_;
  out.load_permille = load_.permille();
  out.nodes_configured = manager_.configured();
  out.nodes_operational = manager_.operational();
  if (services_.flying.competes()) {
    out.flying_master = services_.flying.state();
    out.active_master = services_.flying.active_master();
    out.master_priority = services_.flying.priority();
  }
  out.counters = count();
  out.srdos = services_.srdos.counters();
  out.sleep = services_.sleep.phase();
  return out;
}

Counters NodeLine::count() const {
  Counters out = counters_;
  const node::NodeCounters& of_node = node_.counters();
  const pdo::EngineCounters& of_pdos = node_.pdos().counters();
  out.frames_received = of_node.received.frames;
  out.frames_sent = of_node.sent.frames + services_.lss.sent().frames;
  out.frames_unused += of_node.unused;
  out.frames_malformed +=
      of_node.malformed + sdo_.counters().malformed + of_pdos.too_short + of_pdos.too_long;
  out.rpdos = of_pdos.received;
  out.tpdos = of_pdos.sent;
  out.receptions_lost = of_pdos.receptions_lost;
  out.tpdos_coalesced = of_pdos.coalesced;
  out.syncs = of_node.syncs;
  out.emcys = emergencies_.received();
  for (std::uint8_t id = can::kMinNodeId; id <= can::kMaxNodeId; ++id) {
    out.heartbeats_lost += manager_.node(id).heartbeats_lost;
  }
  (config_.canopen_fd ? out.usdo_transfers : out.sdo_transfers) = sdo_.counters().transfers;
  (config_.canopen_fd ? out.usdo_aborts : out.sdo_aborts) = sdo_.counters().aborts;
  out.events = events_.emitted();
  out.events_lost = events_.lost();
  return out;
}

node::Indicators NodeLine::indicators() const {
  return node_.indicators();
}
std::uint64_t NodeLine::do_node_revision(std::uint8_t id) const {
  return manager_.revision(id);
}
NodeState NodeLine::do_node_state(std::uint8_t id) const {
  return manager_.node(id);
}

// Nothing can be received any more, so the values in the image are invalid.
void NodeLine::interface_lost() {
  services_.lss.interface_lost();
  for (const NodeConfig& device : config_.nodes) {
    node_data_invalid(device.id);
  }
}

void NodeLine::follow_bus(bool asleep, Instant now) {
  OwnOutputs& own = services_.outputs.own();
  if (asleep || !usable()) {
    own.lose_bus();
  } else {
    own.find_bus(now);
  }
}

}  // namespace linegate::line
