// SPDX-License-Identifier: Apache-2.0
// Evaluates the error control messages of other nodes (CiA 301, 7.2.8.3.2.2 and 7.2.8.3.3):
// boot-up, NMT state, and loss of the heartbeat.
//
// Monitoring of a node starts with its first heartbeat and restarts after its boot-up message. Each
// frame is evaluated at its own receive time: a heartbeat after its deadline causes the report of
// the loss (at the deadline) and then of the recovery, whenever advance() is called.
//
// A node may be guarded instead (7.2.8.3.2.1): then it gets requests, and its answers count as
// heartbeats.
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

// Node guarding of one node by the NMT master (CiA 301, 7.2.8.3.2.1): a remote frame on 700h +
// node-ID every guard time; the node answers with one byte.
//   bit 7      toggle bit: 0 in the first answer after a boot-up, then inverted in each answer
//   bits 0..6  NMT state
inline constexpr std::byte kToggleBit{0x80};

// The remote frame that requests the state of the node.
can::Frame guard_request(std::uint8_t node);

struct Guard {
  Duration time{};        // between two requests; 0 = the node is not guarded
  Instant next = kNever;  // the next request
  // The toggle bit expected in the next answer; nothing = either, for the first answer after the
  // start of guarding.
  std::optional<std::byte> toggle;

  bool by_others = false;  // the NMT master guards the node; this consumer sends no requests

  bool asks() const { return time > Duration::zero(); }
  bool active() const { return asks() || by_others; }
  // Clears the toggle bit in the answer. Returns false if it is not the expected one: the answer is
  // to be handled as if it was not received. A boot-up message is not an answer: it makes 0 the
  // expected toggle bit. Precondition: the frame is well-formed.
  bool accept_toggle(can::Frame& answer);
};

// Result of the reception of an error control message.
enum class ErrorControlReception : std::uint8_t {
  accepted,
  // An answer to node guarding with the toggle bit of the one before. CiA 301, 7.2.8.3.2.1: it is
  // handled as if it was not received. The frame is well-formed.
  not_alternated,
  // Neither a boot-up message nor a heartbeat nor an answer: length other than 1, reserved state,
  // toggle bit in a heartbeat.
  malformed,
};

// Called within receive() and advance(), after the event was emitted. The default of every function
// does nothing.
class HeartbeatListener {
 public:
  virtual ~HeartbeatListener() = default;
  virtual void boot_up(std::uint8_t node, Instant now);
  // Called for every heartbeat, after heartbeat_recovered() where that applies.
  virtual void heartbeat(std::uint8_t node, State state, Instant now);
  virtual void heartbeat_lost(std::uint8_t node, Instant deadline);
  virtual void heartbeat_recovered(std::uint8_t node, Instant now);
};

// Emits boot_up, node_state, heartbeat_lost and heartbeat_recovered. node is 1..127 everywhere;
// other values have no effect.
class HeartbeatConsumer {
 public:
  // Registers its frames as Service::error_control with index = mark | node-ID: with different
  // marks (multiples of 128) several consumers share one dispatch. transmit receives the requests
  // of guard(). All must outlive this object.
  HeartbeatConsumer(can::Dispatch& dispatch, EventLog& events, std::uint16_t mark = 0,
                    can::TransmitQueue* transmit = nullptr);
  ~HeartbeatConsumer();
  HeartbeatConsumer(const HeartbeatConsumer&) = delete;
  HeartbeatConsumer& operator=(const HeartbeatConsumer&) = delete;

  void set_listener(HeartbeatListener* listener) { listener_ = listener; }
  // Another consumer, which listens to all nodes, emits boot_up and node_state instead.
  void leave_states_to_another() { emits_states_ = false; }

  // Registers for the node's error control messages, monitored or not.
  void listen(std::uint8_t node);
  // Registers for all nodes except the own one.
  void listen_all(std::uint8_t own);
  // Deregisters the node; also ends its monitoring and discards its state.
  void ignore(std::uint8_t node);

  // Expects a heartbeat within `time` of the previous one, from the next heartbeat on. 0 has the
  // effect of stop().
  void monitor(std::uint8_t node, Duration time);
  // Requests the node's state every guard_time (100Ch) from now on. Without a valid answer for
  // guard_time x life_time_factor (100Dh), from now on, the node is lost. A product of 0 has the
  // effect of stop(). Without a transmit queue no request is sent.
  void guard(std::uint8_t node, Duration guard_time, std::uint8_t life_time_factor, Instant now);
  // The NMT master guards the node and this consumer sends no requests: the node's answers have the
  // toggle bit. Without a valid answer for life_time after the previous one the node is lost; 0 =
  // never. Ends the requests of guard(). No effect if the node's guarding is already overheard.
  void overhear_guarding(std::uint8_t node, Duration life_time);
  // Requests the node's state once, guarded or not; the answer counts as a heartbeat, whatever its
  // toggle bit. Without a transmit queue no request is sent.
  void ask(std::uint8_t node);
  // Ends monitoring and guarding; the node stays registered.
  void stop(std::uint8_t node);

  // A frame on 700h + node, received at frame.time. No effect unless it is accepted; the owner
  // counts the others, and reports malformed ones.
  ErrorControlReception receive(std::uint8_t node, const can::Frame& frame);

  // Reports losses whose deadline is <= now, and sends guarding requests that are due.
  void advance(Instant now);
  Instant next_wake() const;

  State state(std::uint8_t node) const;     // unknown until a message was received
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
    bool asked = false;  // ask() sent a request that was not answered yet
    Guard guard;
  };

  static bool exists(std::uint8_t node) {
    return node >= can::kMinNodeId && node <= can::kMaxNodeId;
  }
  ErrorControlReception take(std::uint8_t node, const can::Frame& frame);
  Instant next_deadline() const;
  void lose(std::uint8_t id);
  void recover(std::uint8_t id, State state, Instant now);
  void receive_boot_up(std::uint8_t id, Instant now);
  void receive_heartbeat(std::uint8_t id, State state, Instant now);
  void request(Instant now);
  void set_deadline(Node& node, Instant deadline);

  can::Dispatch& dispatch_;
  EventLog& events_;
  std::uint16_t mark_;
  can::TransmitQueue* transmit_;
  std::size_t guarded_ = 0;        // number of guarded nodes
  Instant next_request_ = kNever;  // the earliest Guard::next
  bool emits_states_ = true;
  HeartbeatListener* listener_ = nullptr;
  std::array<Node, can::kMaxNodeId + 1> nodes_{};
  mutable Instant next_ = kNever;
  mutable bool next_is_stale_ = false;
};

}  // namespace linegate::nmt
