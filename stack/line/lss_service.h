// SPDX-License-Identifier: Apache-2.0
// CommandKind::lss, and the LSS master of a line in the role manager: node-IDs for devices that
// have none, before the network boots and for late comers (CiA 305). Private to stack/line.
#pragma once

#include <deque>
#include <optional>
#include <vector>

#include "stack/base/event_log.h"
#include "stack/can/traffic.h"
#include "stack/line/command.h"
#include "stack/line/config.h"
#include "stack/line/node_id_check.h"
#include "stack/line/service.h"
#include "stack/lss/assigner.h"
#include "stack/lss/procedure.h"
#include "stack/manager/manager.h"

namespace linegate::line {

class LssService final : public Service, public sdo::TransferOwner, lss::AssignerHost {
 public:
  // All but inputs must outlive it; see NodeIdCheck.
  LssService(ServiceHost& host, const LineConfig& config, manager::Manager& manager,
             const NodeIdCheck::Services& services, std::span<const pdo::LinkedPdo> inputs,
             EventLog& events);
  ~LssService() override { sdo_.disown(*this); }

  // The line is NMT master from now on. The first round begins at once, if there is to be one; the
  // manager starts the network when the nodes of the configuration have their node-IDs.
  void start(Instant now);

  std::span<const CommandKind> commands() const override;
  // Answered with what a lss::Course replies, or the findings of a round; a service that no device
  // confirms when the bus acknowledged its frame. Refusals: wrong_role, line_down, busy (too many
  // wait, or the node-ID cannot be checked now), bad_request, wrong_state (the own node is
  // stopped), no_acknowledge, timed_out.
  void execute(Command command, Instant now) override;
  void advance(Instant now) override;
  Instant next_wake() const override;
  // Rounds end, too: the network is not started by it.
  void end(Refusal why, Instant now) override;

  // acknowledged() has an effect.
  bool awaits_acknowledgement() const { return listens() || number_ != 0; }
  // While listens(): all frames.
  bool listens() const { return check_.listens(); }
  void hear(std::span<const can::Frame> frames) { check_.hear(frames); }
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

  // Answers it, unless it was queued.
  Refusal queue(const Command& command, Instant now);
  void start_network(Instant now);
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
  void finish_command(Error error, std::vector<std::byte> data, Instant now);
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
  manager::Manager& manager_;
  sdo::Arbiter& sdo_;
  manager::Host& nmt_;
  EventLog& events_;
  NodeIdCheck check_;
  lss::Master master_;
  lss::Assigner assigner_;
  std::deque<Asked> asked_;  // the first is carried out if running_
  bool running_ = false;
  bool usable_ = false;
  bool started_ = false;
  bool holding_ = false;  // the start of the network
  bool network_started_ = false;
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
  can::Traffic sent_;
};

}  // namespace linegate::line
