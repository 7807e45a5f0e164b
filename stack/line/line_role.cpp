// SPDX-License-Identifier: Apache-2.0
// The role of the line, master or slave (1F80h bit 0), and what the manager calls of the line.
#include <algorithm>

#include "stack/line/build.h"
#include "stack/line/line_impl.h"

namespace linegate::line {

// What 1F80h bit 0 says, which may have been stored.
void Line::Impl::take_role(Instant now) {
  manages_ = startup.wants_manager();
  receivers_changed = true;
  node.set_nmt_slave(!manages_);
  nmt.set_active(manages_);
  if (manages_) {
    node.dispatch().add(lss::kSlaveId, false, can::Service::lss, 0);
    lss.start(now);
    return;
  }
  for (const NodeConfig& device : config.nodes) {
    const bool guarded = device.guard_time * device.life_time_factor > Duration::zero();
    if (guarded && consumer_time(device) <= Duration::zero()) {
      heartbeats.overhear_guarding(device.id, Duration::zero());  // the master may stop any time
    } else {
      heartbeats.monitor(device.id, consumer_time(device));
    }
  }
}

// Manager and device are exchanged at run time. As a device the own node waits for its master, in
// the state that it is in.
void Line::Impl::change_role(Instant now) {
  if (!running || startup.wants_manager() == manages_) {
    return;
  }
  if (manages_) {
    refuse_sendings(CommandKind::nmt, Refusal::wrong_role, now);
    for (Service* service : services) {
      if (service->needs_master()) {
        service->end(Refusal::wrong_role, now);
      }
    }
    for (const NodeConfig& device : config.nodes) {
      const bool shows_itself = std::max(device.heartbeat, device.guard_time) > Duration::zero();
      if (shows_itself && manager.boots(device.id)) {
        expect_state(device.id);  // what was received before or in its boot process is no sign
      }
    }
    manager.hand_over(now);
  } else {
    for (const NodeConfig& device : config.nodes) {
      heartbeats.stop(device.id);
    }
  }
  take_role(now);
}

void Line::Impl::may_operate(Instant now) {
  node.command(nmt::Command::start, now);
}

void Line::Impl::send_nmt(nmt::Command command, std::uint8_t id, Instant now) {
  nmt.send(command, id, now);
  note_sent(command, id, now);
}

void Line::Impl::command_own(nmt::Command command, Instant now) {
  node.command(command, now);
}

nmt::State Line::Impl::own_state() const {
  return node.state();
}

}  // namespace linegate::line
