// SPDX-License-Identifier: Apache-2.0
// The role of the line, master or slave (1F80h bit 0), and the callbacks of the manager and the
// records.
#include <algorithm>

#include "stack/line/build.h"
#include "stack/line/node_line.h"
#include "stack/sdo/protocol.h"

namespace linegate::line {

// Takes the role of 1F80h bit 0, which may be a stored value, and of the flying master.
void NodeLine::adopt_role(Instant now) {
  manages_ = wants_manager();
  services_.receivers.mark_changed();
  node_.set_nmt_slave(!manages_);
  nmt_.set_active(manages_);
  if (services_.flying.is_passive()) {
    services_.receivers.follow();  // before a PDO is sent
  }
  if (manages_) {
    node_.dispatch().add(lss::kSlaveId, false, can::Service::lss, 0);
    services_.lss.start(now);
    return;
  }
  for (const NodeConfig& device : config_.nodes) {
    const bool guarded = device.guard_time * device.life_time_factor > Duration::zero();
    if (guarded && consumer_time(device) <= Duration::zero()) {
      // The master may stop guarding at any time
      heartbeats_.overhear_guarding(device.id, Duration::zero());
    } else {
      heartbeats_.monitor(device.id, consumer_time(device));
    }
  }
}

// Changes between manager and device at run time. As a device the own node keeps its NMT state and
// waits for commands of its master.
void NodeLine::change_role(Instant now) {
  if (!running_ || sleeps() || wants_manager() == manages_) {
    return;
  }
  if (manages_) {
    for (Service* service : services()) {
      if (service->needs_master()) {
        service->end(Refusal::wrong_role, now);
      }
    }
    for (const NodeConfig& device : config_.nodes) {
      const bool shows_itself = std::max(device.heartbeat, device.guard_time) > Duration::zero();
      if (shows_itself && manager_.boots(device.id)) {
        services_.receivers.expect_state(
            device.id);  // a state received before or during its boot process does not count
      }
    }
    manager_.hand_over(now, services_.flying.is_passive());
    if (services_.flying.is_passive()) {
      services_.sdo.end(Refusal::wrong_role, now);
      services_.pdo_request.end(Refusal::wrong_role, now);
      refuse_unsent(CommandKind::mpdo_write, Refusal::wrong_role, now);
      services_.outputs.give_up(now);
      drop_frames_of_master();
    }
  } else {
    for (const NodeConfig& device : config_.nodes) {
      heartbeats_.stop(device.id);
    }
  }
  adopt_role(now);
}

// What waits for the bus. The SDO servers of the nodes are the new master's; transfers that had
// begun are aborted.
void NodeLine::drop_frames_of_master() {
  using can::TransmitClass;
  can::TransmitQueue& queue = node_.transmit();
  const auto any = [](const can::Frame& /*frame*/) { return true; };
  (void)queue.remove(TransmitClass::sync, any);
  (void)queue.remove(TransmitClass::time, any);
  (void)queue.remove(TransmitClass::error_control, [](const can::Frame& frame) {
    return frame.remote();  // node guarding
  });
  node_.pdos().drop_requests();
  (void)queue.remove(TransmitClass::sdo, [](const can::Frame& frame) {
    const bool is_request = frame.id > can::kSdoRequestBase &&
                            frame.id <= can::kSdoRequestBase + can::kMaxNodeId && !frame.fd();
    return is_request && frame.data[0] != std::byte{sdo::command_byte(sdo::ClientCommand::abort)};
  });
}

// The own node keeps its NMT state, so that other nodes can still end their work with it. NMT
// commands that wait for the inhibit time are still sent.
void NodeLine::prepare_sleep(Instant now) {
  manager_.sleep(now);
  for (Service* service : services()) {
    if (service->needs_master() && service != &services_.nmt) {
      service->end(Refusal::wrong_state, now);
    }
  }
  process_completions(now);
  node_.suspend(now);
  for (const NodeConfig& device : config_.nodes) {
    heartbeats_.stop(device.id);
    node_data_invalid(device.id);
  }
  follow_bus(true, now);
  services_.receivers.mark_changed();
  services_.receivers.follow();
}

// Transfers and procedures under way end; a frame that still waits is never sent. Writes to the own
// dictionary send none.
void NodeLine::fall_silent(Instant now) {
  nmt_.set_active(false);
  end_sendings(now);
  for (Service* service : services()) {
    if (service != &services_.local) {
      service->end(Refusal::wrong_state, now);
    }
  }
  process_completions(now);
  manager_.fall_silent();
  node_.command(nmt::Command::stop, now);
}

void NodeLine::fall_asleep(Instant /*now*/) {
  manager_.fall_silent();  // nodes that were still heard
  services_.diagnosis.diagnosis().fell_asleep();
}

// All nodes reset their communication by themselves, as if the master had commanded it: their
// values before that no longer count.
void NodeLine::wake_up(Instant now) {
  constexpr auto kReset = nmt::Command::reset_communication;
  dirty_ = true;
  end_sendings(now);
  woke_at_ = now;
  manager_.wake(now);
  services_.receivers.heard(kReset, 0);
  services_.diagnosis.diagnosis().commanded(kReset, 0);
  node_.resume();
  node_.command(kReset, now);
  follow_bus(false, now);
  if (wants_manager() != manages_) {
    change_role(now);
  } else {
    adopt_role(now);
  }
}

// The nodes that were asleep have reset their communication: what they reported before that does
// not count.
void NodeLine::others_changed() {
  dirty_ = true;
  for (const NodeConfig& device : config_.nodes) {
    if (!others_sleep() && manager_.node(device.id).heartbeat_monitored) {
      services_.receivers.expect_state(device.id);
    }
  }
  services_.receivers.mark_changed();
  services_.receivers.follow();
}

void NodeLine::mandatory_nodes_booted(Instant now) {
  node_.command(nmt::Command::start, now);
}

void NodeLine::send_nmt(nmt::Command command, std::uint8_t id, Instant now) {
  if (sleeps()) {
    return;
  }
  nmt_.send(command, id, now);
  nmt_sent(command, id, now);
}

void NodeLine::nmt_sent(nmt::Command command, std::uint8_t id, Instant now) {
  services_.diagnosis.diagnosis().commanded(command, id);
  manager_.sent(command, id, now);
  services_.lss.commanded(command, id);
  services_.receivers.commanded(command, id);
}

void NodeLine::command_own(nmt::Command command, Instant now) {
  node_.command(command, now);
}

nmt::State NodeLine::own_state() const {
  return node_.state();
}

AbortCode NodeLine::may_trigger(std::uint8_t id, std::uint8_t rpdo) const {
  return services_.outputs.may_trigger({.node = id, .number = rpdo});
}

void NodeLine::order_nmt(nmt::Command command, std::uint8_t id, Instant now, std::uint32_t client) {
  (void)services_.nmt.send(command, id, now, client);
}

void NodeLine::order_trigger(std::uint8_t id, std::uint8_t rpdo, Instant now) {
  std::vector<std::uint16_t> triggered;
  (void)services_.outputs.trigger({.node = id, .number = rpdo}, triggered, now);
}

}  // namespace linegate::line
