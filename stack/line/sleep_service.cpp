// SPDX-License-Identifier: Apache-2.0
#include "stack/line/sleep_service.h"

#include <array>
#include <utility>
#include <vector>

#include "stack/can/cob_id.h"
#include "stack/diagnosis/foreign_manager.h"

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
  const bool follows = protocol_.exists() && host().is_running();
  return follows ? std::optional(sleep_.phase()) : std::nullopt;
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
  if (line_.is_stopped_by_error() || !sleep_.check(then_sleep, now)) {
    return Refusal::wrong_state;
  }
  checking_ = command;
  checking_until_ = command.timeout > Duration::zero() ? deadline(now, command.timeout) : kNever;
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
  if (line_.is_stopped_by_error() || !sleep_.prepare(now)) {
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

void SleepService::answer_unsent(FramesUnderWay::Sending& sending, Instant now) {
  const SleepAction action = std::get<SleepRequest>(sending.command.request).action;
  const bool prepares = action == SleepAction::sleep || action == SleepAction::prepare;
  if (prepares && sleep_.awaits_acknowledge()) {
    sleep_.give_up(now);
    follow();
  }
  Service::answer_unsent(sending, now);
}

// A wake message that is still under way does not count.
void SleepService::handed_out(const can::Frame& frame, std::uint64_t number, Instant now) {
  if (frame.id != protocol_.request || frame.extended() ||
      frame.data[0] != std::byte{sleep_.awaited_byte()}) {
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

void SleepService::interface_lost(Instant now) {
  if (host().is_running()) {
    sleep_.lose_bus(now);
    follow();
  }
}

// A master that stopped its network during the check does not let it sleep.
void SleepService::update_objection() {
  sleep_.set_objection(objects_ || settings_.sleep_objection ||
                       (host().manages() && line_.is_stopped_by_error()));
}

bool SleepService::receive(const can::Frame& frame) {
  if (!host().is_running()) {
    return true;
  }
  sleep_.set_master(host().manages(), frame.time);
  update_objection();
  const bool good = sleep_.receive(frame);
  follow();
  if (host().manages() && good && frame.id == protocol_.request && !frame.remote()) {
    follow_foreign(frame);
  }
  return good;
}

// A master obeys no other one. Its own sleep makes the nodes wait anyway.
void SleepService::follow_foreign(const can::Frame& frame) {
  const auto code = std::to_integer<std::uint8_t>(frame.data[0]);
  if (code == protocol_.wake_byte) {
    set_others_sleep({});
  } else if (code == protocol_.prepare_byte && !sleeps()) {
    report_foreign(frame);
    set_others_sleep(frame.time + protocol_.prepare_time + protocol_.silent_time);
  }
}

void SleepService::report_foreign(const can::Frame& frame) {
  if (reported_ != Instant{} && frame.time - reported_ < diagnosis::ForeignManager::kInterval) {
    return;
  }
  reported_ = frame.time;
  events_.emit({.time = frame.time,
                .data = event::ForeignManager{.evidence = event::ManagerEvidence::sleep,
                                              .identifier = frame.id}});
}

void SleepService::set_others_sleep(Instant until) {
  const bool before = others_sleep();
  others_sleep_until_ = until;
  if (others_sleep() != before) {
    line_.others_changed();
  }
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
    update_objection();
    sleep_.advance(now);
    follow();
    expire_check(now);
    if (others_sleep_until_ <= now) {
      set_others_sleep({});
    }
  }
}

void SleepService::expire_check(Instant now) {
  if (checking_ && checking_until_ <= now) {
    const Command command = *std::exchange(checking_, std::nullopt);
    (void)sleep_.wake(now);
    follow();
    host().refuse(command, Refusal::timed_out, now);
  }
}

Instant SleepService::next_wake() const {
  if (!host().is_running()) {
    return kNever;
  }
  const Instant others = others_sleep() ? others_sleep_until_ : kNever;
  return earlier(earlier(sleep_.next_wake(), others), checking_ ? checking_until_ : kNever);
}

bool SleepService::start() {
  const bool slept = sleep_.sleeps();
  sleep_.reset();
  number_ = 0;
  others_sleep_until_ = {};
  reported_ = {};
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
    if (frame.id == protocol_.request) {
      number_ = 0;
    }
    // One objection answers any number of requests that precede it.
    const can::Header header{.id = frame.id, .length = frame.length, .flags = frame.flags};
    if (frame.id == protocol_.request || !node_.transmit().holds(can::TransmitClass::nmt, header)) {
      (void)node_.transmit().push(can::TransmitClass::nmt, frame);
    }
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
        set_others_sleep({});      // the wake-up is for all nodes
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
