// SPDX-License-Identifier: Apache-2.0
// The manager's place in the line: its role, what it asks of the line, and the command `boot`:
// boot processes made anew, and answered when all of them have come to an end.
#include <algorithm>
#include <utility>

#include "stack/base/deadline.h"
#include "stack/line/build.h"
#include "stack/line/line_impl.h"
#include "stack/manager/boot_report.h"

namespace linegate::line {
namespace {

constexpr char kNotListed = 'A';

}  // namespace

// What 1F80h bit 0 says, which may have been stored.
void Line::Impl::take_role(Instant now) {
  manages_ = startup.wants_manager();
  receivers_changed = true;
  node.set_nmt_slave(!manages_);
  nmt.set_active(manages_);
  if (manages_) {
    boot_begun = false;
    start_lss(now);
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
    end_scan(Refusal::wrong_role, now);
    end_boots(Refusal::wrong_role);
    end_configure(Refusal::wrong_role);
    end_program(Refusal::wrong_role, now);
    boot_begun = true;  // a round of LSS that ends by this begins none
    lss.stop();
    settle_lss(now);
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

void Line::Impl::start_boot(const Command& command, Instant now) {
  if (command.node > can::kMaxNodeId || command.node == config.node_id) {
    refuse(command, Refusal::bad_request, now);
    return;
  }
  if (!manages()) {
    refuse(command, Refusal::wrong_role, now);
    return;
  }
  if (!usable()) {
    refuse(command, Refusal::line_down, now);
    return;
  }
  Boot boot{.tag = command.tag};
  boot.deadline =
      command.timeout > Duration::zero() ? linegate::deadline(now, command.timeout) : kNever;
  for (std::uint8_t id = can::kMinNodeId; id <= can::kMaxNodeId; ++id) {
    if (command.node == id || (command.node == 0 && manager.node(id).configured)) {
      boot.nodes.push_back(id);
    }
  }
  manager.boot(command.node, now);
  boots.push_back(std::move(boot));
  finish_boots(now);
}

void Line::Impl::finish_boots(Instant now) {
  std::erase_if(boots, [&](const Boot& boot) {
    if (!std::ranges::all_of(boot.nodes, [this](auto id) { return manager.concluded(id); })) {
      if (boot.deadline > now) {
        return false;
      }
      reply(boot.tag, to_error(Refusal::timed_out));
      return true;
    }
    std::vector<manager::BootOutcome> outcomes;
    for (const std::uint8_t id : boot.nodes) {
      const NodeState& booted = manager.node(id);
      outcomes.push_back({.node = id,
                          .letter = booted.configured ? booted.boot : kNotListed,
                          .finding = booted.finding});
    }
    reply(boot.tag, Error{}, manager::write_boot_report(outcomes));
    return true;
  });
}

void Line::Impl::end_boots(Refusal why) {
  for (const Boot& boot : std::exchange(boots, {})) {
    reply(boot.tag, to_error(why));
  }
}

}  // namespace linegate::line
