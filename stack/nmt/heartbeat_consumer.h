// What the error control messages of other nodes say (CiA 301, 7.2.8.3.2.2 and 7.2.8.3.3): boot-up,
// NMT state, and loss of the heartbeat.
//
// Monitoring a node starts with its first heartbeat and starts over after its boot-up message. Each
// frame is judged at its own receive time: a heartbeat that comes after its deadline tells the loss
// (at the deadline) and then the recovery, no matter when advance() ran.
#pragma once

#include <array>
#include <cstdint>

#include "stack/base/event_log.h"
#include "stack/base/time.h"
#include "stack/can/cob_id.h"
#include "stack/can/dispatch.h"
#include "stack/can/frame.h"
#include "stack/nmt/state.h"

namespace linegate::nmt {

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
  // different marks (multiples of 128) several consumers share one dispatch. Both must outlive it.
  HeartbeatConsumer(can::Dispatch& dispatch, EventLog& events, std::uint16_t mark = 0);
  ~HeartbeatConsumer();
  HeartbeatConsumer(const HeartbeatConsumer&) = delete;
  HeartbeatConsumer& operator=(const HeartbeatConsumer&) = delete;

  void set_listener(HeartbeatListener* listener) { listener_ = listener; }

  // Wants the node's error control messages, monitored or not.
  void listen(std::uint8_t node);
  // Of all nodes but the own one.
  void listen_all(std::uint8_t own);
  // No longer wants them; ends the monitoring too and forgets what was known.
  void ignore(std::uint8_t node);

  // Expects a heartbeat within `time` after the one before, from the next heartbeat on. 0 is
  // stop().
  void monitor(std::uint8_t node, Duration time);
  // Ends the monitoring; goes on listening.
  void stop(std::uint8_t node);

  // A frame on 700h + node, at frame.time. False if it is neither a boot-up message nor a heartbeat
  // (length other than 1, reserved state): nothing was done then, and the owner tells it.
  bool receive(std::uint8_t node, const can::Frame& frame);

  // Tells the losses whose deadline is <= now.
  void advance(Instant now);
  Instant next_wake() const;

  State state(std::uint8_t node) const;  // unknown until something was heard
  bool monitored(std::uint8_t node) const;
  bool lost(std::uint8_t node) const;  // from the loss until the next heartbeat
  Duration time(std::uint8_t node) const;

 private:
  struct Node {
    Duration time{};            // 0 = not monitored
    Instant deadline = kNever;  // kNever = waiting for the first heartbeat
    State state = State::unknown;
    bool listening = false;
    bool lost = false;
  };

  static bool exists(std::uint8_t node) {
    return node >= can::kMinNodeId && node <= can::kMaxNodeId;
  }
  void lose(std::uint8_t id);
  void recover(std::uint8_t id, State state, Instant now);
  void take_boot_up(std::uint8_t id, Instant now);
  void take_heartbeat(std::uint8_t id, State state, Instant now);
  void set_deadline(Node& node, Instant deadline);
  void emit(EventKind kind, std::uint8_t id, Instant time, std::uint32_t code, std::uint32_t value);

  can::Dispatch& dispatch_;
  EventLog& events_;
  std::uint16_t mark_;
  HeartbeatListener* listener_ = nullptr;
  std::array<Node, can::kMaxNodeId + 1> nodes_{};
  mutable Instant next_ = kNever;
  mutable bool next_is_stale_ = false;
};

}  // namespace linegate::nmt
