// SPDX-License-Identifier: Apache-2.0
// The boot slave process of CiA 302-2 for one node, from the check whether it is listed (A) to its
// error control (K). Program and configuration are separate steps, see boot_step.h.
//
// Each transfer is made once (sdo::TransferOptions::repeats is 0): 1000h is read again every second
// anyway, and after it a lost frame ends the process with the letter of its step, like any abort. A
// node that stops answering during the process, or whose answer does not match the request, is
// retried without limit, like a node that never answered. So is a node that aborts the upload of
// 1000h, which is boot status B. Only a refusal or a wrong device ends the process. A communication
// error, such as 0504 0001h, counts as a refusal after three consecutive occurrences, when the boot
// time-out is also over (as for an abort of 1000h): a device that is still starting may answer so.
//
// A node that was reset and shows Operational or Stopped before its boot-up message did not receive
// the NMT command: it is reset again, at most three times.
//
// A node that boots up while it is configured is configured again, after increasing pauses. Such
// restarts do not restart the boot time-out; when it expires, kRestarts is reported as the result
// of the process, which continues with the same pauses.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>

#include "stack/base/event_log.h"
#include "stack/base/time.h"
#include "stack/manager/boot_step.h"
#include "stack/manager/host.h"
#include "stack/manager/network_list.h"
#include "stack/manager/plan.h"
#include "stack/manager/state.h"
#include "stack/nmt/heartbeat_consumer.h"
#include "stack/sdo/arbiter.h"

namespace linegate::manager {

// Shared by all boot processes of a line. All references must outlive them.
struct BootServices {
  const NetworkList& list;
  Duration sdo_timeout{};
  sdo::Arbiter& sdo;
  sdo::TransferOwner& owner;  // owner of all their transfers; it forwards the completions
  nmt::HeartbeatConsumer& heartbeats;
  EventLog& events;
  Host& host;
};

class BootSlave final : private StepContext {
 public:
  enum class Reason : std::uint8_t {
    present,   // may be running: read 1000h at once
    reset,     // a reset was sent: read 1000h after its boot-up message, or NodePlan::reset_time
    boots_up,  // its boot-up message was received
  };

  // plan and node must outlive it. The process updates node with values read and states received.
  BootSlave(const NodePlan& plan, const BootServices& services, NodeState& node);

  // The step that checks and updates the program (bit 5 of 1F81h): without it such a node ends with
  // G. The step that configures: without it nothing is written. Call both before begin().
  void set_program(std::unique_ptr<BootStep> step) { program_ = std::move(step); }
  void set_configuration(std::unique_ptr<BootStep> step) { configuration_ = std::move(step); }

  // command: the reset that was sent, with Reason::reset.
  void begin(Reason reason, Instant now, nmt::Command command = nmt::Command::reset_communication);
  // Ends the process without a result.
  void cancel();

  // Whose frames those of the process are from now on, see sdo::Request::client; 0 = nobody's. A
  // process that begins with a boot-up message after the end of the last one is nobody's.
  // cancel() ends that, too.
  void set_client(std::uint32_t client) { client_ = client; }
  std::uint32_t client() const { return client_; }

  // The node sent its boot-up message: starts again, unless the process itself reset the node.
  void boot_up(Instant now);
  // An NMT command other than a reset was sent to the node: the states that it shows from now on
  // may be the effect of that command.
  void commanded() { reset_.waits_for_boot_up = false; }
  // The node sent a heartbeat, or an answer to node guarding.
  void heartbeat(nmt::State state, Instant now);
  // Its error control was lost. True if that is the result of the process (K): no heartbeat or
  // answer was received since the node was configured.
  bool heartbeat_lost(Instant now);
  // The transfer for which awaits(number) is true has ended.
  void completed(const sdo::Completion& answer, Instant now);
  bool awaits(std::uint64_t number) const { return number == transfer_ && number != 0; }

  void advance(Instant now);
  Instant next_wake() const { return wake_; }

  bool under_way() const { return step_ != Step::idle; }
  // It began, and has ended for good: only another begin() continues.
  bool has_ended() const { return step_ == Step::done; }
  // The node may restart because its program is stopped or started.
  bool loads_program() const { return step_ == Step::program; }
  // The process waits before it configures a node again that restarted during its configuration.
  bool pauses() const { return restarts_ > 1 && step_ == Step::retry; }
  // Error control of the node was started since its last boot-up message: its heartbeat was
  // configured, or it is guarded.
  bool started_error_control() const { return started_error_control_; }
  // The node may have other PDOs than those of the image: it was reset, restarted or was found
  // running, and no process has configured it since. A process that finds a node running that the
  // last one configured does not change this: until it ends, the node has the PDOs that it had.
  // false if the network list has it as a node that is not booted.
  bool has_unknown_pdos() const { return pdos_ == Pdos::unknown; }
  // The node sent its boot-up message, also while the manager is not active.
  void note_restart() {
    started_error_control_ = false;
    forget_pdos();
  }
  // The process has reported that the node does not answer, and tries again every second.
  bool searching() const { return reported_; }

  // Returns the result once, see NodeState::boot: when the process has ended, and when a node does
  // not answer, after which the process tries again every second.
  std::optional<char> pop_result();

 private:
  enum class Step : std::uint8_t {
    idle,
    wait_boot_up,
    device_type,
    identity,
    keep_alive,
    wait_reset,
    program,
    configuration,
    error_control,
    retry,
    done,
  };

  // Whether `step` may follow `before`.
  static bool may_follow(Step before, Step step);

  const NodePlan& plan() const override { return plan_; }
  Duration sdo_timeout() const override;
  bool is_kept_alive() const override { return was_operational_; }
  void submit(sdo::Request request, Instant now) override;

  bool has(std::uint32_t bits) const { return (assignment_ & bits) == bits; }
  void read_device_type(Instant now);
  void check_device_type(const sdo::Completion& completion, Instant now);
  void next_identity(Instant now);
  void check_identity(const sdo::Completion& completion, Instant now);
  void check_keep_alive(Instant now);
  void reset(Instant now);
  void reset_and_continue(Step by, nmt::Command command, Instant now);
  void send_reset(nmt::Command command, Instant now);
  bool missed_reset(nmt::State state, Instant now) const;
  void repeat_reset(Instant now);
  void restarted(Instant now);
  void abandon_step();
  void clear();
  void forget_pdos();
  void state_unknown();
  void missing();
  void after_reset(Instant now);
  void check_program(Instant now);
  void configure(Instant now);
  void run(BootStep& step, Step which, Instant now);
  BootStep& running();
  void process_step_end(Instant now);
  void start_error_control(Instant now);
  void no_error_control(Instant now);
  void fail(char letter, BootFinding finding, Instant now);
  void finish(char letter, const BootFinding& finding, Instant now);
  void search(char letter, const BootFinding& finding, Instant now);
  void report(char letter, const BootFinding& finding, Instant now);
  void upload(od::Address address, Instant now);
  void set_step(Step step, Instant wake);

  const NodePlan& plan_;
  const BootServices& services_;
  NodeState& node_;
  std::unique_ptr<BootStep> program_;
  std::unique_ptr<BootStep> configuration_;

  Step step_ = Step::idle;
  Step reset_by_ = Step::idle;  // the step to continue after the reset
  Instant wake_ = kNever;
  Instant ended_{};  // the last Step::done
  // From then on a missing answer is boot status B, and repeated aborts are a refusal
  Instant give_up_ = kNever;
  bool reported_ = false;         // the reason why the process keeps trying was reported
  bool booted_up_ = false;        // a boot-up message was received: the node cannot be Operational
  bool was_operational_ = false;  // boot status L
  bool started_error_control_ = false;
  enum class Pdos : std::uint8_t {
    unmanaged,  // the node is not booted, or the last process was cancelled
    compared,   // the last process has configured the node
    unknown,
  };
  Pdos pdos_ = Pdos::unmanaged;
  // The last NMT reset of the node.
  struct Reset {
    bool waits_for_boot_up = false;
    nmt::Command command = nmt::Command::reset_communication;
    Instant sent{};
    unsigned repeats = 0;
  };
  Reset reset_;
  // Number of boot-up messages of a node that restarts while it is configured, and the object that
  // was written last.
  unsigned restarts_ = 0;
  od::Address last_written_{};
  bool said_ = false;             // the node itself aborted the last transfer
  std::uint32_t refusals_ = 0;    // number of consecutive equal aborts
  std::uint32_t assignment_ = 0;  // 1F81h at the start of the process
  std::uint8_t identity_sub_ = 0;
  std::uint32_t client_ = 0;
  std::uint64_t transfer_ = 0;  // in progress; 0 = none
  std::uint64_t sequence_ = 0;
  std::optional<char> result_;
};

}  // namespace linegate::manager
