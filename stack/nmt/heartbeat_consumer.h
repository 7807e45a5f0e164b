// SPDX-License-Identifier: Apache-2.0
// What the error control messages of other nodes say (CiA 301, 7.2.8.3.2.2 and 7.2.8.3.3): boot-up,
// NMT state, and loss of the heartbeat.
//
// Monitoring a node starts with its first heartbeat and starts over after its boot-up message. Each
// frame is judged at its own receive time: a heartbeat that comes after its deadline tells the loss
// (at the deadline) and then the recovery, no matter when advance() ran.
//
// A node may be guarded instead (7.2.8.3.2.1): then it is asked, and its answers are its heartbeat.
#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "stack/base/event_log.h"
#include "stack/base/time.h"
#include "stack/can/cob_id.h"
#include "stack/can/dispatch.h"
#include "stack/can/frame.h"
#include "stack/can/transmit_queue.h"
#include "stack/nmt/state.h"

namespace linegate::nmt {

// Node guarding as the NMT master of one node sees it (CiA 301, 7.2.8.3.2.1): a remote frame on
// 700h + node-ID every guard time; the node answers with one byte.
//   bit 7      toggle bit: 0 in the first answer after a boot-up, then the other of the last answer
//   bits 0..6  NMT state
inline constexpr std::byte kToggleBit{0x80};

// The remote frame that asks the node.
can::Frame guard_request(std::uint8_t node);

struct Guard {
  Duration time{};        // between two requests; 0 = the node is not guarded
  Instant next = kNever;  // the next request
  // What the next answer must show; nothing = whatever comes first after the guarding began.
  std::optional<std::byte> toggle;

  bool by_others = false;  // its master asks it; nobody here does

  bool asks() const { return time > Duration::zero(); }
  bool active() const { return asks() || by_others; }
  // Takes the toggle bit away. False if it is not the expected one: an answer that counts for
  // nothing. Boot-up messages are no answers: they make 0 the expected one.
  bool take_toggle(can::Frame& answer);
};

// Event::code of heartbeat_lost: by which error control.
inline constexpr std::uint32_t kByHeartbeat = 0;
inline constexpr std::uint32_t kByNodeGuarding = 1;
inline constexpr std::uint32_t kByLifeGuarding = 2;  // of the own node, which its master guarded

// Told from within receive() and advance(), after the event was emitted. Every function has a
// default that does nothing.
class HeartbeatListener {
 public:
  virtual ~HeartbeatListener() = default;
  virtual void boot_up(std::uint8_t node, Instant now);
  // Every heartbeat, after heartbeat_recovered() if it is one.
  virtual void heartbeat(std::uint8_t node, State state, Instant now);
  virtual void heartbeat_lost(std::uint8_t node, Instant deadline);
  virtual void heartbeat_recovered(std::uint8_t node, Instant now);
};

// Emits boot_up, node_state, heartbeat_lost and heartbeat_recovered. node is 1..127 everywhere;
// other values have no effect.
class HeartbeatConsumer {
 public:
  // Frames wanted are registered as Service::error_control with index = mark | node-ID: with
  // different marks (multiples of 128) several consumers share one dispatch. transmit takes the
  // requests of guard(). All must outlive it.
  HeartbeatConsumer(can::Dispatch& dispatch, EventLog& events, std::uint16_t mark = 0,
                    can::TransmitQueue* transmit = nullptr);
  ~HeartbeatConsumer();
  HeartbeatConsumer(const HeartbeatConsumer&) = delete;
  HeartbeatConsumer& operator=(const HeartbeatConsumer&) = delete;

  void set_listener(HeartbeatListener* listener) { listener_ = listener; }
  // boot_up and node_state are events of another consumer, which listens to all nodes.
  void leave_states_to_another() { emits_states_ = false; }

  // Wants the node's error control messages, monitored or not.
  void listen(std::uint8_t node);
  // Of all nodes but the own one.
  void listen_all(std::uint8_t own);
  // No longer wants them; ends the monitoring too and forgets what was known.
  void ignore(std::uint8_t node);

  // Expects a heartbeat within `time` after the one before, from the next heartbeat on. 0 is
  // stop().
  void monitor(std::uint8_t node, Duration time);
  // Asks the node for its state every guard_time (100Ch) from now on; without a right answer for
  // guard_time x life_time_factor (100Dh) it is lost, the time until the first one included. A
  // product of 0 is stop(). Without a transmit queue nobody is asked.
  void guard(std::uint8_t node, Duration guard_time, std::uint8_t life_time_factor, Instant now);
  // Its master guards the node, and nothing is asked: its answers carry the toggle bit. Without a
  // right answer for life_time after the one before it is lost; 0 = never. Requests of
  // guard() end. No effect if it is guarded so already.
  void overhear_guarding(std::uint8_t node, Duration life_time);
  // Asks the node for its state once, guarded or not; the answer is taken as a heartbeat, whatever
  // its toggle bit. Without a transmit queue nobody is asked.
  void ask(std::uint8_t node);
  // Ends monitoring and guarding; goes on listening.
  void stop(std::uint8_t node);

  // A frame on 700h + node, at frame.time. False if it is neither a boot-up message nor a heartbeat
  // (length other than 1, reserved state, the wrong toggle bit in the answer of a guarded node):
  // nothing was done then, and the owner tells it.
  bool receive(std::uint8_t node, const can::Frame& frame);

  // Tells the losses whose deadline is <= now, and asks the guarded nodes whose turn it is.
  void advance(Instant now);
  Instant next_wake() const;

  State state(std::uint8_t node) const;     // unknown until something was heard
  bool monitored(std::uint8_t node) const;  // or guarded
  bool guarded(std::uint8_t node) const;
  bool lost(std::uint8_t node) const;  // from the loss until the next heartbeat
  Duration time(std::uint8_t node) const;

 private:
  struct Node {
    Duration time{};            // 0 = not monitored
    Instant deadline = kNever;  // kNever = waiting for the first heartbeat
    State state = State::unknown;
    bool listening = false;
    bool lost = false;
    bool asked = false;  // by ask(), and has not answered
    Guard guard;
  };

  static bool exists(std::uint8_t node) {
    return node >= can::kMinNodeId && node <= can::kMaxNodeId;
  }
  bool take(std::uint8_t node, const can::Frame& frame);
  Instant next_deadline() const;
  void lose(std::uint8_t id);
  void recover(std::uint8_t id, State state, Instant now);
  void take_boot_up(std::uint8_t id, Instant now);
  void take_heartbeat(std::uint8_t id, State state, Instant now);
  void request(Instant now);
  void set_deadline(Node& node, Instant deadline);
  void emit(EventKind kind, std::uint8_t id, Instant time, std::uint32_t code, std::uint32_t value);

  can::Dispatch& dispatch_;
  EventLog& events_;
  std::uint16_t mark_;
  can::TransmitQueue* transmit_;
  std::size_t guarded_ = 0;        // how many nodes are
  Instant next_request_ = kNever;  // the earliest of them
  bool emits_states_ = true;
  HeartbeatListener* listener_ = nullptr;
  std::array<Node, can::kMaxNodeId + 1> nodes_{};
  mutable Instant next_ = kNever;
  mutable bool next_is_stale_ = false;
};

}  // namespace linegate::nmt
