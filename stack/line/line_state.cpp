// SPDX-License-Identifier: Apache-2.0
// The state of a line that has a node of its own, and its counters.
#include "stack/line/line_impl.h"

namespace linegate::line {

LineState Line::Impl::state() const {
  LineState out;
  out.role = role();
  out.node_id = config.node_id;
  out.network_id = config.network_id;
  out.own_state = node.state();
  out.indicators = node.indicators();
  out.manager = manager.state();
  out.network = diagnosing.diagnosis().network_state();
  out.bus = bus;
  out.transmit_errors = transmit_errors;
  out.receive_errors = receive_errors;
  out.load_permille = load.permille();
  out.nodes_configured = manager.configured();
  out.nodes_operational = manager.operational();
  out.counters = count();
  return out;
}

Counters Line::Impl::count() const {
  Counters out = counters;
  const node::NodeCounters& of_node = node.counters();
  const pdo::EngineCounters& of_pdos = node.pdos().counters();
  out.frames_received = of_node.received.frames;
  out.frames_sent = of_node.sent.frames + lss.sent().frames;
  out.frames_unused = of_node.unused;
  out.frames_malformed +=
      of_node.malformed + sdo.counters().malformed + of_pdos.too_short + of_pdos.too_long;
  out.rpdos = of_pdos.received;
  out.tpdos = of_pdos.sent;
  out.receptions_lost = of_pdos.receptions_lost;
  out.tpdos_coalesced = of_pdos.coalesced;
  out.syncs = of_node.syncs;
  out.emcys = emergencies.received();
  for (std::uint8_t id = can::kMinNodeId; id <= can::kMaxNodeId; ++id) {
    out.heartbeats_lost += manager.node(id).heartbeats_lost;
  }
  out.sdo_transfers = sdo.counters().transfers;
  out.sdo_aborts = sdo.counters().aborts;
  out.events = events.emitted();
  out.events_lost = events.lost();
  return out;
}

node::Indicators Line::Impl::indicators() const {
  return node.indicators();
}
std::uint64_t Line::Impl::node_revision(std::uint8_t id) const {
  return manager.revision(id);
}
NodeState Line::Impl::node_state(std::uint8_t id) const {
  return manager.node(id);
}

// Nothing can be heard: what the image shows is not from living nodes any more.
void Line::Impl::interface_lost() {
  lss.interface_lost();
  for (const NodeConfig& device : config.nodes) {
    node_data_invalid(device.id);
  }
}

}  // namespace linegate::line
