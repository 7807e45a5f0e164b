// SPDX-License-Identifier: Apache-2.0
// CommandKind::lss, and the LSS master of a line in the role manager: assigns node-IDs to devices
// that have none, before the network boots and to devices connected later (CiA 305). Private to
// stack/line.
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
#include "stack/sdo/outbox.h"

namespace linegate::line {

class LssService final : public Service, public sdo::TransferOwner, lss::AssignerHost {
 public:
  // All except inputs must outlive the service; see NodeIdCheck.
  LssService(ServiceHost& host, const LineConfig& config, manager::Manager& manager,
             const NodeIdCheck::Services& services, std::span<const pdo::LinkedPdo> inputs,
             EventLog& events);
  ~LssService() override { sdo_.disown(*this); }

  // The line is NMT master from now on. The first round begins immediately if one is configured;
  // the manager starts the network when the configured nodes have their node-IDs.
  void start(Instant now);

  std::span<const CommandKind> commands() const override;
  // Answered with the reply of an lss::Course, or the findings of a round; an unconfirmed service
  // when the bus acknowledged its frame. Refusals: wrong_role, line_down, busy (too many commands
  // wait, in all or of the client, or the node-ID cannot be checked now), bad_request, wrong_state
  // (the own node is stopped), no_acknowledge, timed_out.
  void execute(Command command, Instant now) override;
  void advance(Instant now) override;
  Instant next_wake() const override;
  // Also ends rounds, without starting the network.
  void end(Refusal why, Instant now) override;

  // Whether acknowledged() has an effect.
  bool awaits_acknowledgement() const { return listens() || number_ != 0; }
  // While it returns true, pass all frames to hear().
  bool listens() const { return check_.listens(); }
  void hear(std::span<const can::Frame> frames) { check_.hear(frames); }
  // While listens(), too: see NodeIdCheck.
  void handed_out(const can::Frame& frame, std::uint64_t number, Instant now) {
    check_.handed_out(frame, number, now);
  }
  void acknowledged(std::uint64_t number, Instant now);
  void lost(std::uint64_t first, std::uint64_t last);
  // Answers all commands; a round under way is repeated when the bus is usable again.
  void interface_lost();
  // sdo::TransferOwner: transfers of the node-ID check.
  void completed(sdo::Completion& completion, Instant now) override;
  // An NMT command to a node, or to all with 0, was sent or received.
  void commanded(nmt::Command command, std::uint8_t node) { check_.commanded(command, node); }
  // The boot-up message or a heartbeat of the node was received.
  void boot_up(std::uint8_t node);
  void heartbeat(std::uint8_t node);

  // Processes a frame on 7E4h. Returns false if it is malformed.
  bool receive(const can::Frame& frame);
  // Returns the next LSS frame; less urgent than all frames of the own node. number: as in
  // handed_out().
  bool next_frame(can::Frame& out, std::uint64_t number, Instant now);
  // False while the client of the command exceeds its share, see sdo::Pace.
  bool wants_to_send() const { return master_.wants_to_send() && is_permitted(); }
  const can::Traffic& sent() const { return sent_; }

 private:
  struct Asked {
    std::uint64_t tag = 0;
    std::uint32_t client = 0;
    lss::Procedure procedure = lss::Procedure::assign;
    std::optional<lss::Course> course;  // nothing for Procedure::assign
    Instant deadline = kNever;
  };

  // A device that was assigned its node-ID and has not booted yet: no other device may get this
  // node-ID.
  struct Given {
    std::uint8_t node = 0;
    std::optional<lss::Address> address{};  // nothing: assigned by a command
    Instant due = kNever;                   // time of NMT reset communication to it
    bool was_reset = false;                 // if it does not boot then, it is absent
    bool selected = false;                  // a command assigned it; the device is still selected
  };

  // Answers the command unless it was queued.
  Refusal queue(const Command& command, Instant now);
  void start_network(Instant now);
  bool is_present(std::uint8_t node) const override;
  bool is_watched(std::uint8_t node) const override;
  void pump(Instant now);
  void begin_service(const lss::Request& request, Instant now);
  bool begin_next(Instant now);
  void receive_answer(const lss::Answer& answer, Instant now);
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
  void report(const lss::Finding& finding, Instant now);
  void report_progress(unsigned parts, Instant now);
  void expire(Instant now);
  void end_running();
  void interface_back(Instant now);
  void release_if_stuck(Instant now);
  // Whose command is executed; 0 = nobody's.
  std::uint32_t client() const { return running_ && !asked_.empty() ? asked_.front().client : 0; }
  bool is_permitted() const { return sdo_.permits(client()); }
  bool is_paced() const { return master_.wants_to_send() && !is_permitted(); }
  void look_again(Instant now) { retry_at_ = is_paced() ? now + sdo::Outbox::kRetry : kNever; }
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
  std::deque<Asked> asked_;  // the first is executed while running_
  bool running_ = false;
  bool usable_ = false;
  bool started_ = false;
  bool holding_ = false;  // the start of the network is held
  bool network_started_ = false;
  bool interrupted_ = false;  // a round was interrupted and is repeated
  unsigned reported_parts_ = 0;
  std::vector<Given> given_;
  Instant next_round_ = kNever;
  Instant hands_off_until_{};  // a command put devices into configuration
  Instant hold_until_ = kNever;
  Instant stuck_at_ = kNever;   // while holding: then a frame that was not sent counts as stuck
  can::Frame given_frame_{};    // returned by next_frame()
  Instant given_at_{};          // time of given_frame_
  std::uint64_t number_ = 0;    // of given_frame_; 0 = acknowledged
  bool lost_ = false;           // given_frame_ will never be acknowledged
  Instant unsent_at_ = kNever;  // of a command: then a frame that still waits cannot be sent
  Instant retry_at_ = kNever;   // when the pace may permit the next frame
  can::Traffic sent_;
};

}  // namespace linegate::line
