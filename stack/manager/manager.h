// The CANopen manager of one line in its simple form (CiA 302-2): resets, checks, configures and
// starts the configured nodes, watches their heartbeats, and boots them again when they come back.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "stack/base/event_log.h"
#include "stack/base/time.h"
#include "stack/can/transmit_queue.h"
#include "stack/manager/boot_slave.h"
#include "stack/manager/plan.h"
#include "stack/manager/state.h"
#include "stack/nmt/heartbeat_consumer.h"
#include "stack/nmt/state.h"
#include "stack/sdo/arbiter.h"

namespace linegate::manager {

// What the manager asks of the line it belongs to.
class Host {
 public:
  virtual ~Host() = default;
  // The process data of the node can no longer be trusted: lost, reset or starting anew.
  virtual void node_data_invalid(std::uint8_t node) = 0;
  // Every mandatory node is booted: the own node may become Operational.
  virtual void may_operate(Instant now) = 0;
  // Sends an NMT command to one node, or to all with 0.
  virtual void send_nmt(nmt::Command command, std::uint8_t node) = 0;
};

class Manager {
 public:
  // References must outlive it. Plans are ascending by id, ids are unique.
  Manager(std::vector<NodePlan> plans, Options options, sdo::Arbiter& sdo,
          nmt::HeartbeatConsumer& heartbeats, EventLog& events, Host& host);

  void start(Instant now);
  void stop(Instant now);

  // What was heard of a node, 1..127, configured or not.
  void boot_up(std::uint8_t node, Instant now);
  void heartbeat(std::uint8_t node, nmt::State state, Instant now);
  void heartbeat_lost(std::uint8_t node, Instant now);
  void heartbeat_recovered(std::uint8_t node, Instant now);
  void emergency(std::uint8_t node, std::uint16_t code, std::uint8_t error_register, Instant now);
  // A transfer with kManagerToken in its token.
  void completed(const sdo::Completion& completion, Instant now);
  // Somebody asked for this NMT command by a Command; it has been sent. node 0 = all.
  void commanded(nmt::Command command, std::uint8_t node, Instant now);

  void advance(Instant now);
  Instant next_wake() const;

  ManagerState state() const { return state_; }
  // 1..127; nodes never heard of and not configured are unknown.
  const NodeState& node(std::uint8_t id) const { return nodes_[id]; }
  // Grows with every change of that NodeState.
  std::uint64_t revision(std::uint8_t id) const { return revisions_[id]; }
  std::uint8_t configured() const { return static_cast<std::uint8_t>(slots_.size()); }
  std::uint8_t operational() const;

 private:
  struct Slot {
    NodePlan plan;
    std::unique_ptr<BootSlave> boot;
    bool concluded = false;  // its boot process ended, well or not, at least once
    Instant reset_at{};      // when it was last told to reset
  };

  Slot* find(std::uint8_t node);
  void settle(Slot& slot, Instant now);
  void start_node(std::uint8_t node);
  void release_own_node(Instant now);
  void update_state(Instant now);
  void set_state(ManagerState state, Instant now);
  void assume_state(std::uint8_t node, nmt::Command command);
  void begin(Slot& slot, Instant now, bool expect_boot_up);
  void reset(Slot& slot, nmt::Command command, Instant now);
  bool active() const {
    return state_ != ManagerState::inactive && state_ != ManagerState::stopped;
  }
  void touch(std::uint8_t node) { ++revisions_[node]; }

  Options options_;
  sdo::Arbiter& sdo_;
  nmt::HeartbeatConsumer& heartbeats_;
  EventLog& events_;
  Host& host_;
  ManagerState state_ = ManagerState::inactive;
  bool released_ = false;  // may_operate() was told
  std::vector<Slot> slots_;
  std::array<NodeState, 128> nodes_;
  std::array<std::uint64_t, 128> revisions_{};
};

}  // namespace linegate::manager
