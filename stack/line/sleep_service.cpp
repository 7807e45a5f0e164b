// SPDX-License-Identifier: Apache-2.0
#include "stack/line/sleep_service.h"

#include <array>
#include <utility>
#include <vector>

#include "stack/can/cob_id.h"

namespace linegate::line {

SleepService::SleepService(ServiceHost& host, SleepHost& line, const nmt::SleepProtocol& protocol,
                           node::Node& node, const diagnosis::ControlSettings& settings,
                           EventLog& events)
    : Service(host),
      line_(line),
      node_(node),
      settings_(settings),
      events_(events),
      protocol_(protocol),
      sleep_(protocol, node.node_id()) {
  if (protocol.exists()) {
    node.dispatch().add(protocol.request, false, can::Service::sleep, 0);
    node.dispatch().add(protocol.objection, false, can::Service::sleep, 0);
  }
}

std::span<const CommandKind> SleepService::commands() const {
  static constexpr std::array kCommands{CommandKind::sleep};
  return kCommands;
}

std::optional<nmt::SleepPhase> SleepService::phase() const {
  return protocol_.exists() ? std::optional(sleep_.phase()) : std::nullopt;
}

bool SleepService::permits(CommandKind kind) const {
  switch (kind) {
    case CommandKind::sleep:
    case CommandKind::local_read:
    case CommandKind::local_write:
    case CommandKind::can_listen:
    case CommandKind::routing_trace:
    case CommandKind::connection_list:
      return true;
    case CommandKind::sdo_read:
    case CommandKind::sdo_write:
    case CommandKind::network_read:
    case CommandKind::network_write:
    case CommandKind::can_send:
    case CommandKind::emcy_send:
      return sleep_.may_transmit();
    default:
      return !sleep_.sleeps();
  }
}

void SleepService::execute(Command command, Instant now) {
  const Refusal refusal = carry_out(command, std::get<SleepRequest>(command.request).action, now);
  if (refusal != Refusal::none) {
    host().refuse(command, refusal, now);
  }
}

Refusal SleepService::carry_out(const Command& command, SleepAction action, Instant now) {
  if (!protocol_.exists() || !host().is_running()) {
    return Refusal::wrong_state;
  }
  sleep_.set_master(host().manages(), now);
  follow();
  switch (action) {
    case SleepAction::check:
    case SleepAction::sleep:
      return check(command, action == SleepAction::sleep, now);
    case SleepAction::prepare:
      return send_prepare(command, now);
    case SleepAction::wake:
      return wake(command, now);
    case SleepAction::object:
    case SleepAction::consent:
      objects_ = action == SleepAction::object;
      host().reply(command.tag, {}, {});
      return Refusal::none;
  }
  return Refusal::bad_request;
}

Refusal SleepService::check(const Command& command, bool then_sleep, Instant now) {
  if (!host().manages()) {
    return Refusal::wrong_role;
  }
  if (!host().usable()) {
    return Refusal::line_down;
  }
  if (checking_) {
    return Refusal::busy;
  }
  update_objection();
  if (!sleep_.check(then_sleep, now)) {
    return Refusal::wrong_state;
  }
  checking_ = command;
  follow();
  return Refusal::none;
}

Refusal SleepService::send_prepare(const Command& command, Instant now) {
  if (!host().manages()) {
    return Refusal::wrong_role;
  }
  if (!host().usable()) {
    return Refusal::line_down;
  }
  if (!sleep_.prepare(now)) {
    return Refusal::wrong_state;
  }
  follow();
  answer_when_sent(command, protocol_.prepare_byte, now);
  return Refusal::none;
}

// The end of a check needs no message: the other nodes end it by themselves.
Refusal SleepService::wake(const Command& command, Instant now) {
  const bool sleeps = sleep_.sleeps();
  if (sleeps && !host().usable()) {
    return Refusal::line_down;
  }
  if (!sleep_.wake(now)) {
    return sleep_.phase() == nmt::SleepPhase::check ? Refusal::wrong_role : Refusal::wrong_state;
  }
  follow();
  if (sleeps) {
    answer_when_sent(command, protocol_.wake_byte, now);
  } else {
    host().reply(command.tag, {}, {});
  }
  return Refusal::none;
}

void SleepService::answer_when_sent(Command command, std::uint8_t code, Instant now) {
  const can::Frame frame = can::make_frame(protocol_.request, {code});
  host().answer_when_sent({.command = std::move(command), .frames = {{.frame = frame}}}, now);
}

void SleepService::handed_out(const can::Frame& frame, std::uint64_t number, Instant now) {
  if (frame.id != protocol_.request || frame.extended()) {
    return;
  }
  number_ = number;
  if (number == 0) {
    sleep_.acknowledged(now);
  }
}

void SleepService::acknowledged(std::uint64_t number, Instant now) {
  if (number_ != 0 && number_ <= number) {
    number_ = 0;
    sleep_.acknowledged(now);
  }
}

void SleepService::lost(std::uint64_t first, std::uint64_t last) {
  if (number_ >= first && number_ <= last) {
    number_ = 0;
  }
}

void SleepService::update_objection() {
  sleep_.set_objection(objects_ || settings_.sleep_objection);
}

bool SleepService::receive(const can::Frame& frame) {
  if (!host().is_running()) {
    return true;
  }
  sleep_.set_master(host().manages(), frame.time);
  update_objection();
  const bool good = sleep_.receive(frame);
  follow();
  return good;
}

// A stopped line neither sleeps nor wakes.
void SleepService::hear(Instant received) {
  if (host().is_running()) {
    sleep_.hear(received);
    follow();
  }
}

void SleepService::advance(Instant now) {
  if (host().is_running()) {
    sleep_.set_master(host().manages(), now);
    sleep_.advance(now);
    follow();
  }
}

Instant SleepService::next_wake() const {
  return host().is_running() ? sleep_.next_wake() : kNever;
}

bool SleepService::start() {
  const bool slept = sleep_.sleeps();
  sleep_.reset();
  number_ = 0;
  return slept;
}

void SleepService::end(Refusal why, Instant now) {
  if (auto command = std::exchange(checking_, std::nullopt)) {
    host().refuse(*command, why, now);
  }
}

void SleepService::follow() {
  for (const nmt::SleepChange& change : sleep_.pop_changes()) {
    if (change.before == nmt::SleepPhase::check) {
      answer_check(change);
    }
    follow(change);
  }
  send();
}

void SleepService::send() {
  for (const can::Frame& frame : sleep_.pop_frames()) {
    (void)node_.transmit().push(can::TransmitClass::nmt, frame);
  }
}

void SleepService::follow(const nmt::SleepChange& change) {
  events_.emit({.time = change.time,
                .node = change.node,
                .data = event::SleepState{
                    .phase = change.phase, .before = change.before, .cause = change.cause}});
  switch (change.phase) {
    case nmt::SleepPhase::prepare:
      line_.prepare_sleep(change.time);
      return;
    case nmt::SleepPhase::silent:
      line_.fall_silent(change.time);
      return;
    case nmt::SleepPhase::asleep:
      line_.fall_asleep(change.time);
      return;
    case nmt::SleepPhase::awake:
      if (change.before >= nmt::SleepPhase::prepare) {
        node_.transmit().clear();  // what waited before the silence is old
        send();                    // the other nodes wake before they are reset
        line_.wake_up(change.time);
      }
      return;
    case nmt::SleepPhase::check:
      return;
  }
}

void SleepService::answer_check(const nmt::SleepChange& change) {
  const auto command = std::exchange(checking_, std::nullopt);
  if (!command) {
    return;
  }
  switch (change.cause) {
    case nmt::SleepCause::command:
      host().refuse(*command, Refusal::cancelled, change.time);
      return;
    case nmt::SleepCause::role:
      host().refuse(*command, Refusal::wrong_role, change.time);
      return;
    case nmt::SleepCause::no_acknowledge:
      host().refuse(*command, Refusal::no_acknowledge, change.time);
      return;
    default:
      break;
  }
  if (change.phase == nmt::SleepPhase::prepare) {
    answer_when_sent(*command, protocol_.prepare_byte, change.time);
  } else {
    answer_objections(*command);
  }
}

void SleepService::answer_objections(const Command& command) {
  std::vector<std::byte> nodes;
  for (std::uint8_t node = can::kMinNodeId; node <= can::kMaxNodeId; ++node) {
    if (sleep_.objections()[node]) {
      nodes.push_back(std::byte{node});
    }
  }
  host().reply(command.tag, {}, nodes.empty() ? ReplyData{} : ReplyData{std::move(nodes)});
}

}  // namespace linegate::line
