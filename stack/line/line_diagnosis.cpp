// SPDX-License-Identifier: Apache-2.0
// What the diagnosis of a line is told of it.
#include "stack/line/build.h"
#include "stack/line/line_impl.h"
#include "stack/nmt/node_control.h"
#include "stack/od/objects.h"

namespace linegate::line {

diagnosis::Options diagnosis_options(const LineConfig& config) {
  diagnosis::Options out{.own_node = config.node_id};
  for (const NodeConfig& node : config.nodes) {
    out.assigned.set(node.id);
    out.mandatory.set(node.id, node.mandatory);
  }
  out.fatal_events =
      config.strict_ixxat ? diagnosis::kStrictlyFatalEvents : diagnosis::kFatalEvents;
  return out;
}

diagnosis::CanopenIaOptions canopen_ia_options(const LineConfig& config) {
  return {.base = config.canopen_ia_base,
          .own_node = config.node_id,
          .manager = config.role == Role::manager,
          .revision = config.identity.revision,
          .serial = config.identity.serial,
          .settings = {.keep_operational = config.keep_operational,
                       .heartbeat = config.found_heartbeat,
                       .update_time = config.pdo_update_time}};
}

diagnosis::NetworkFacts Line::Impl::network() const {
  constexpr od::Address kNmtStartup{od::objects::kNmtStartup, 0};
  constexpr std::uint64_t kSlavesNotStarted = 1U << 3U;
  const std::uint64_t bits = node.dictionary().number(kNmtStartup).value_or(0);
  return {.running = running,
          .manages = manages(),
          .own = node.state(),
          .manager = manager.state(),
          .starts_nodes = (bits & kSlavesNotStarted) == 0,
          .scanning = scan_of_all && scanner.active()};
}

// What cannot be run with is not run: all nodes are stopped, the own one too.
void Line::Impl::stop_network(Instant now) {
  manager.halt(now);
}

// Out of the state fatal error there is but this way.
void Line::Impl::begin_anew(nmt::Command command, Instant now) {
  node.command(command, now);
  manager.start(now);
}

void Line::Impl::keep_operational(std::uint8_t id, Instant now) {
  if (canopen_ia.keep_operational() && manages() && diagnosis.strayed(id)) {
    nmt.send(nmt::Command::start, id, now);
    note_sent(nmt::Command::start, id, now);
  }
}

void Line::Impl::consumer_lost(std::uint8_t id, Instant deadline) {
  manager.consumer_lost(id, deadline);
}

void Line::Impl::boot_up(std::uint8_t id, Instant now) {
  confirm(id, nmt::State::initialising, now);
  lss.boot_up(id);
  manager.boot_up(id, now);
  scanner.boot_up(id, now);
}

void Line::Impl::heartbeat(std::uint8_t id, nmt::State state, Instant now) {
  confirm(id, state, now);
  lss.heartbeat(id);
  diagnosis.heard(id, state, now);
  manager.heartbeat(id, state, now);
  keep_operational(id, now);
}

void Line::Impl::heartbeat_lost(std::uint8_t id, Instant deadline) {
  manager.heartbeat_lost(id, deadline);
}

void Line::Impl::heartbeat_recovered(std::uint8_t id, Instant now) {
  manager.heartbeat_recovered(id, now);
}

// Commands of another master, or of the master while the own node is NMT slave.
void Line::Impl::hear_nmt(std::uint16_t index, const can::Frame& frame) {
  if (index != 0 || manages()) {
    foreign_manager.receive(index, frame);
  }
  const auto control = index == 0 ? nmt::decode_node_control(frame) : std::nullopt;
  if (control) {
    manager.sent(control->command, control->node, frame.time);
    if (frame.id == can::kNmtId) {
      note_command(control->command, control->node);
      manager.heard(control->command, control->node);
    }
  }
}

void Line::Impl::follow_diagnosis(Instant now) {
  follow_records(now);
  if (diagnosis.take_failure() && manages()) {
    stop_network(now);
  }
  diagnosis.update(now);
}

const NodeState& Line::Impl::node_seen(std::uint8_t id) const {
  return manager.node(id);
}

void Line::Impl::node_data_invalid(std::uint8_t id) {
  diagnosis.states_changed();
  image.set_node_valid(id, false);
  node.pdos().drop_waiting(id);
  outputs_invalid(id);
}

}  // namespace linegate::line
