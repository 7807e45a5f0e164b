// SPDX-License-Identifier: Apache-2.0
// The LSS master of a line in the role manager: node-IDs for devices that have none before the
// network boots and for late comers, and CommandKind::lss. Private to stack/line.
#pragma once

#include <deque>
#include <optional>
#include <vector>

#include "stack/base/event_log.h"
#include "stack/can/traffic.h"
#include "stack/line/command.h"
#include "stack/line/config.h"
#include "stack/line/node_id_check.h"
#include "stack/lss/assigner.h"
#include "stack/lss/procedure.h"
#include "stack/manager/manager.h"

namespace linegate::line {

class Lss final : public sdo::TransferOwner, lss::AssignerHost {
 public:
  // All but inputs must outlive it; see NodeIdCheck.
  Lss(const LineConfig& config, const NodeIdCheck::Services& services,
      std::span<const pdo::LinkedPdo> inputs, EventLog& events);
  ~Lss() override { sdo_.disown(*this); }

  // usable: the bus can be used. The first round begins at once, if there is to be one.
  void start(bool usable, Instant now);
  // The line stops: commands under way are answered.
  void stop();
  // Nodes of the configuration are being given their node-IDs: their boot waits for that.
  bool holds_boot() const { return holding_; }

  // False if a queue is full. take_reply() has its answer sooner or later.
  bool execute(Command command, Instant now);
  struct Answered {
    Reply reply;
    // Of a service that no device confirms: the reply holds when the bus acknowledged this frame,
    // which next_frame() gave.
    std::optional<can::Frame> frame{};
    Instant deadline = kNever;  // of the command
  };
  std::optional<Answered> take_reply();

  // acknowledged() has an effect.
  bool awaits_acknowledgement() const { return listens() || number_ != 0; }
  // While listens(): all frames.
  bool listens() const { return check_.listens(); }
  void hear(std::span<const can::Frame> frames);
  // The same: see NodeIdCheck.
  void handed_out(const can::Frame& frame, std::uint64_t number, Instant now) {
    check_.handed_out(frame, number, now);
  }
  void acknowledged(std::uint64_t number, Instant now);
  void lost(std::uint64_t first, std::uint64_t last);
  // Commands are answered, and a round that was under way begins again when the bus can be used.
  void interface_lost();
  // sdo::TransferOwner: of the check of node-IDs.
  void completed(sdo::Completion& completion, Instant now) override;
  // An NMT command to a node, or all with 0, was sent or heard.
  void commanded(nmt::Command command, std::uint8_t node) { check_.commanded(command, node); }
  // Its boot-up message, or a heartbeat.
  void boot_up(std::uint8_t node);
  void heartbeat(std::uint8_t node);

  // A frame on 7E4h. False if it is malformed.
  bool receive(const can::Frame& frame);
  // usable: false puts off what is to begin.
  void advance(bool usable, Instant now);
  Instant next_wake() const;
  // Less urgent than all that the own node sends. number: as in handed_out().
  bool next_frame(can::Frame& out, std::uint64_t number, Instant now);
  bool wants_to_send() const { return master_.wants_to_send(); }
  const can::Traffic& sent() const { return sent_; }

 private:
  struct Asked {
    std::uint64_t tag = 0;
    lss::Procedure procedure = lss::Procedure::assign;
    std::optional<lss::Course> course;  // but for assign
    Instant deadline = kNever;
  };

  // A device that was given its node-ID, and has not booted yet: the node-ID is that of no other.
  struct Given {
    std::uint8_t node = 0;
    std::optional<lss::Address> address{};  // nothing: by a command
    Instant due = kNever;                   // then it gets NMT reset communication
    bool was_reset = false;                 // after that it is not there
    bool selected = false;                  // by a command, to the device that is selected still
  };

  bool is_present(std::uint8_t node) const override;
  bool is_watched(std::uint8_t node) const override;
  void pump(Instant now);
  void begin_service(const lss::Request& request, Instant now);
  bool begin_next(Instant now);
  void take_answer(const lss::Answer& answer, Instant now);
  std::optional<std::uint8_t> node_to_check() const;
  bool check_node_id(Instant now);
  void follow_assigner(Instant now);
  bool is_given_to_another(std::uint8_t node) const;
  void deselect();
  Duration reset_time(std::uint8_t node) const;
  void await_boot_up(std::uint8_t node, const std::optional<lss::Address>& address, Instant due);
  void reset_given(Instant now);
  void note_configuration(const lss::Answer& answer, Instant now);
  void finish_command(Error error, std::vector<std::byte> data);
  void finish_round(Instant now);
  void tell(const lss::Finding& finding, Instant now);
  void tell_progress(unsigned parts, Instant now);
  void expire(Instant now);
  void end_running();
  void interface_back(Instant now);
  void release_if_stuck(Instant now);
  bool is_unsent() const { return master_.wants_to_send() || number_ != 0; }
  bool course_runs() const { return !asked_.empty() && asked_.front().course && running_; }

  const LineConfig& config_;
  const manager::Manager& manager_;
  sdo::Arbiter& sdo_;
  manager::Host& host_;
  EventLog& events_;
  NodeIdCheck check_;
  lss::Master master_;
  lss::Assigner assigner_;
  std::deque<Asked> asked_;  // the first is carried out if running_
  bool running_ = false;
  bool usable_ = false;
  bool started_ = false;
  bool holding_ = false;
  bool interrupted_ = false;  // a round: it begins again
  unsigned told_parts_ = 0;
  std::vector<Given> given_;
  Instant next_round_ = kNever;
  Instant hands_off_until_{};  // a person has devices in configuration
  Instant hold_until_ = kNever;
  Instant stuck_at_ = kNever;   // while holding: a frame that nobody took until then cannot be sent
  can::Frame given_frame_{};    // by next_frame()
  Instant given_at_{};          // that frame
  std::uint64_t number_ = 0;    // the same; 0 = acknowledged
  bool lost_ = false;           // it will never be
  Instant unsent_at_ = kNever;  // of a command: its frame that waits then cannot be sent
  std::deque<Answered> replies_;
  can::Traffic sent_;
};

}  // namespace linegate::line
