// The boot slave process of CiA 302-2 for one node, in its simple form: device type, identity,
// configuration, error control. Software update (steps 7, 8) and keep-alive (6) are not part of it.
//
// Each transfer is made once (sdo::TransferOptions::repeats is 0): 1000h is read again every second
// anyway, and from then on a lost frame ends the process with the letter of its step, as any abort.
// A node that came back for a moment is better booted as a whole than asked for the rest.
#pragma once

#include <cstdint>
#include <optional>

#include "stack/base/event_log.h"
#include "stack/base/time.h"
#include "stack/manager/plan.h"
#include "stack/manager/state.h"
#include "stack/nmt/heartbeat_consumer.h"
#include "stack/sdo/arbiter.h"

namespace linegate::manager {

// How long a node that was told to reset may take until its boot-up message.
inline constexpr Duration kResetWait = std::chrono::seconds(1);

class BootSlave {
 public:
  // All references must outlive it. node is updated with what is read and heard.
  BootSlave(const NodePlan& plan, Duration sdo_timeout, sdo::Arbiter& sdo,
            nmt::HeartbeatConsumer& heartbeats, EventLog& events, NodeState& node);

  // Starts anew: with reading 1000h at once, or, after a reset, when kResetWait is over. The node's
  // boot-up message is the reason to call it again before that.
  void begin(Instant now, bool expect_boot_up);
  // Ends it without a result.
  void cancel();

  // The node was heard with a heartbeat.
  void heartbeat(Instant now);
  // The end of a transfer that owns(token).
  void completed(const sdo::Completion& completion, Instant now);
  bool owns(std::uint64_t token) const { return token == token_ && token != 0; }

  void advance(Instant now);
  Instant next_wake() const { return wake_; }

  // Once when the process has ended: kBooted or the letter, also for B, after which it goes on
  // trying every second.
  std::optional<char> take_result();

 private:
  enum class Step : std::uint8_t {
    idle,
    wait_boot_up,
    device_type,
    identity,
    configure,
    wait_heartbeat,
    retry,
    done,
  };

  void read_device_type(Instant now);
  void next_identity(Instant now);
  void check_identity(const sdo::Completion& completion, Instant now);
  void next_write(Instant now);
  void start_error_control(Instant now);
  void no_answer(const sdo::Completion& completion, Instant now);
  void finish(char letter, std::uint32_t value, Instant now);
  void upload(od::Address address, Instant now);
  void submit(sdo::Request request, Instant now);
  void set_step(Step step, Instant wake);

  const NodePlan& plan_;
  Duration sdo_timeout_;
  sdo::Arbiter& sdo_;
  nmt::HeartbeatConsumer& heartbeats_;
  EventLog& events_;
  NodeState& node_;

  Step step_ = Step::idle;
  Instant wake_ = kNever;
  Instant give_up_ = kNever;  // when no answer becomes boot status B
  bool b_told_ = false;
  std::uint8_t identity_sub_ = 0;
  std::size_t write_ = 0;
  std::uint64_t token_ = 0;
  std::uint32_t sequence_ = 0;
  std::optional<char> result_;
};

// Tokens of the manager's transfers have this bit set; others must not.
inline constexpr std::uint64_t kManagerToken = std::uint64_t{1} << 63U;

}  // namespace linegate::manager
