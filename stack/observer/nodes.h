// SPDX-License-Identifier: Apache-2.0
// The nodes of a line as seen by a passive listener. Their states are derived from boot-up
// messages, heartbeats, answers to node guarding, NMT commands of any master, and PDOs.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "stack/base/event_log.h"
#include "stack/base/time.h"
#include "stack/can/dispatch.h"
#include "stack/can/frame.h"
#include "stack/emcy/consumer.h"
#include "stack/manager/plan.h"
#include "stack/manager/shared_id.h"
#include "stack/manager/state.h"
#include "stack/manager/state_changes.h"
#include "stack/nmt/heartbeat_consumer.h"
#include "stack/nmt/life_signs.h"
#include "stack/nmt/node_control.h"

namespace linegate::observer {

// Receives changes of nodes.
class NodeListener {
 public:
  virtual ~NodeListener() = default;
  // The process data of the node are no longer valid: it was lost or reset, or is not Operational.
  virtual void node_data_invalid(std::uint8_t node) = 0;
  // An NMT command resets the node; it may still send frames that it had queued before.
  virtual void node_reset(std::uint8_t node) = 0;
  // The node has sent its boot-up message.
  virtual void node_booted(std::uint8_t node) = 0;
};

class Nodes final : nmt::HeartbeatListener, emcy::Listener {
 public:
  // Registers error control and EMCY of all nodes with the dispatch: Service::error_control and
  // Service::emcy, index = node-ID. master: the node-ID of the NMT master, which is not reported as
  // unexpected; 0 = not known. Only the error control settings of the plans are used. All
  // references must outlive this object.
  Nodes(std::span<const manager::NodePlan> plans, std::uint8_t master, can::Dispatch& dispatch,
        EventLog& events, NodeListener& listener);
  ~Nodes() override;

  // The node sends its EMCYs on cob_id instead of 80h + node-ID.
  void listen_emcy(std::uint8_t node, can::CobId cob_id);

  // Processes a frame on 700h + node, at frame.time; see HeartbeatConsumer::receive(). Remote
  // frames come from a master that guards the node.
  nmt::ErrorControlReception receive_error_control(std::uint8_t node, const can::Frame& frame);
  // Processes an EMCY of the node, at frame.time. Returns false, without any effect, if it is
  // malformed; the owner reports that.
  bool receive_emcy(std::uint8_t node, const can::Frame& frame);
  // An NMT command of the master; reported as event::NmtCommand.
  void commanded(const nmt::NodeControl& command, Instant now);
  // A PDO of the node was received: the node is present, and Operational unless its error control
  // reports its state.
  void heard_pdo(std::uint8_t node, Instant now);
  // A value of the node's identity (1000h or 1018h) was seen on the bus.
  void identity(std::uint8_t node, od::Address address, std::uint32_t value);

  // All nodes fall asleep: until wake() none is expected to be heard, and none becomes missing.
  // Then all reset their communication by themselves.
  void sleep();
  // No node sends from now on: the states of the nodes are unknown until wake(), what a node still
  // sends included. Call it again when the silence is over.
  void fall_silent();
  void wake(Instant now);

  void advance(Instant now);
  Instant next_wake() const { return earlier(heartbeats_.next_wake(), life_.next_wake()); }

  // id: 1..127. Nodes that were never heard and are not configured are unknown.
  const manager::NodeState& node(std::uint8_t id) const { return nodes_[id]; }
  // Increases with every change of that state.
  std::uint64_t revision(std::uint8_t id) const { return revisions_[id]; }
  std::uint8_t configured() const;
  std::uint8_t operational() const;
  std::uint64_t emcys() const { return emergencies_.received(); }
  // Receives EMCYs of CANopen FD, too.
  void accept_fd_emcys() { emergencies_.accept_fd(); }
  std::uint64_t heartbeats_lost() const;

 private:
  void boot_up(std::uint8_t id, Instant now) override;
  void heartbeat(std::uint8_t id, nmt::State state, Instant now) override;
  void heartbeat_lost(std::uint8_t id, Instant deadline) override;
  void emergency(std::uint8_t id, const emcy::Message& message, Instant now) override;

  void heard(std::uint8_t id, nmt::State state, Instant now);
  bool has_error_control(std::uint8_t id) const;
  void monitor(std::uint8_t id);
  void changed_itself(std::uint8_t id, nmt::State state, nmt::State before, Instant now);
  void miss(std::uint8_t id, manager::Presence presence);
  void apply(const nmt::NodeControl& command, Instant now);
  void assume(std::uint8_t id, nmt::Command command);
  void set_state(std::uint8_t id, nmt::State state);
  // See fall_silent().
  nmt::State shown(nmt::State state) const { return silent_ ? nmt::State::unknown : state; }
  void touch(std::uint8_t id) { ++revisions_[id]; }

  bool asleep_ = false;  // see sleep()
  bool silent_ = false;  // see fall_silent()
  EventLog& events_;
  NodeListener& listener_;
  std::uint8_t master_;
  nmt::HeartbeatConsumer heartbeats_;
  emcy::Consumer emergencies_;
  std::array<manager::NodeState, 128> nodes_;
  std::array<std::uint64_t, 128> revisions_{};
  manager::StateChanges changes_;
  manager::SharedIds shared_;
  nmt::LifeSigns life_;                         // of nodes whose error control is not monitored
  std::array<Duration, 128> heartbeat_time_{};  // configured consumer heartbeat time
  // A heartbeat or guard answer was received since its boot-up message
  std::array<bool, 128> reports_state_{};
  std::array<bool, 128> reset_{};             // reset by an NMT command, and not received since
  std::array<Duration, 128> guarded_time_{};  // configured life time
};

}  // namespace linegate::observer
