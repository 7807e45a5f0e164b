// SPDX-License-Identifier: Apache-2.0
// CommandKind::sleep: sleep of the whole network (nmt/sleep.h), as NMT master or slave. Private to
// stack/line.
#pragma once

#include <cstdint>
#include <optional>
#include <span>

#include "stack/diagnosis/control_record.h"
#include "stack/line/service.h"
#include "stack/nmt/sleep.h"
#include "stack/node/node.h"

namespace linegate::line {

// What the line does for its sleep service.
class SleepHost {
 public:
  SleepHost() = default;
  SleepHost(const SleepHost&) = delete;
  SleepHost& operator=(const SleepHost&) = delete;
  virtual ~SleepHost() = default;

  // From now on no node is expected to be heard, and none receives outputs.
  virtual void prepare_sleep(Instant now) = 0;
  // From now on the line transmits nothing, see SleepService::may_transmit().
  virtual void fall_silent(Instant now) = 0;
  virtual void fall_asleep(Instant now) = 0;
  // The own node and, as master, the network boot.
  virtual void wake_up(Instant now) = 0;
  // Whether the manager stopped the network after an error: the boot after a sleep would start it.
  virtual bool is_stopped_by_error() const = 0;
  // The value of others_sleep() has changed.
  virtual void others_changed() = 0;
};

class SleepService final : public Service {
 public:
  // settings: the objection in the CANopenIA records. All must outlive the service.
  SleepService(ServiceHost& host, SleepHost& line, const nmt::SleepProtocol& protocol,
               node::Node& node, const diagnosis::ControlSettings& settings, EventLog& events);

  std::span<const CommandKind> commands() const override;
  bool needs_master() const override { return false; }
  // Check is answered at its end, with the node-IDs of the nodes that object; sleep likewise, or
  // when the bus acknowledged the prepare message; prepare and wake when it acknowledged theirs;
  // the others at once. Refusals: line_down, wrong_role (the line is not NMT master, or is no
  // longer), busy (another check is under way), wrong_state (sleep is not configured, the line is
  // stopped, the node sleeps, or, for wake, does not), cancelled (by wake), no_acknowledge,
  // bad_request; wrong_state also while the network is stopped by an error. A check that is not
  // over within the time-out of its command ends: timed_out.
  void execute(Command command, Instant now) override;
  void advance(Instant now) override;
  Instant next_wake() const override;
  // The line starts: awake. Returns whether it slept when it was stopped.
  bool start();
  void end(Refusal why, Instant now) override;
  // Prepare that is not acknowledged in time: the network stays awake.
  void answer_unsent(FramesUnderWay::Sending& sending, Instant now) override;

  // A frame of Service::sleep. Returns false if it is malformed.
  bool receive(const can::Frame& frame);
  // Call it for each frame before it is processed, while sleeps() is true.
  void hear(Instant received);
  // A request of the line is on its way to the bus.
  bool awaits_acknowledge() const { return sleep_.awaits_acknowledge(); }
  // A frame was handed to the bus with that number; 0: it counts as acknowledged.
  void handed_out(const can::Frame& frame, std::uint64_t number, Instant now);
  void acknowledged(std::uint64_t number, Instant now);
  void lost(std::uint64_t first, std::uint64_t last);
  // The bus can no longer be used.
  void interface_lost(Instant now);
  bool sleeps() const { return sleep_.sleeps(); }
  bool may_transmit() const { return sleep_.may_transmit(); }
  // Another master sent prepare while this one is awake: until the nodes sleep, or were woken, they
  // take no PDO, whatever their heartbeats report.
  bool others_sleep() const { return others_sleep_until_ != Instant{}; }
  // Nothing if sleep is not configured, or the line is stopped: the network may have woken.
  std::optional<nmt::SleepPhase> phase() const;
  // Whether a command of this kind is executed in the present phase. From prepare on no boot,
  // configuration or other procedure begins, from silent on only what transmits nothing.
  bool permits(CommandKind kind) const;

 private:
  Refusal carry_out(const Command& command, SleepAction action, Instant now);
  Refusal check(const Command& command, bool then_sleep, Instant now);
  Refusal send_prepare(const Command& command, Instant now);
  Refusal wake(const Command& command, Instant now);
  void answer_when_sent(Command command, std::uint8_t code, Instant now);
  void expire_check(Instant now);
  void follow_foreign(const can::Frame& frame);
  void report_foreign(const can::Frame& frame);
  void set_others_sleep(Instant until);
  void follow();
  void follow(const nmt::SleepChange& change);
  void answer_check(const nmt::SleepChange& change);
  void answer_objections(const Command& command);
  void send();
  void update_objection();

  SleepHost& line_;
  node::Node& node_;
  const diagnosis::ControlSettings& settings_;
  EventLog& events_;
  const nmt::SleepProtocol protocol_;
  bool objects_ = false;  // by command
  nmt::Sleep sleep_;
  std::optional<Command> checking_;
  Instant checking_until_ = kNever;  // by the time-out of that command
  Instant others_sleep_until_{};     // see others_sleep()
  Instant reported_{};               // when it reported another master last
  std::uint64_t number_ = 0;  // of the awaited request, on its way to the bus; 0: not handed out
};

}  // namespace linegate::line
