// SPDX-License-Identifier: Apache-2.0
// The CANopen manager of one line (CiA 302-2): resets, checks, configures and starts the nodes of
// the network list, monitors their error control, and boots them again when they return. Its
// settings are the objects 1F80h to 1F8Ah, see network_list.h.
#pragma once

#include <array>
#include <bitset>
#include <cstdint>
#include <functional>
#include <memory>
#include <vector>

#include "stack/base/event_log.h"
#include "stack/base/time.h"
#include "stack/manager/boot_slave.h"
#include "stack/manager/host.h"
#include "stack/manager/network_list.h"
#include "stack/manager/plan.h"
#include "stack/manager/shared_id.h"
#include "stack/manager/state.h"
#include "stack/manager/state_changes.h"
#include "stack/nmt/heartbeat_consumer.h"
#include "stack/nmt/life_signs.h"
#include "stack/nmt/state.h"
#include "stack/sdo/arbiter.h"

namespace linegate::manager {

class Manager final : public sdo::TransferOwner {
 public:
  // dictionary: of the own node, with network_objects(). All references must outlive the manager.
  // Plans are ascending by id, and ids are unique.
  Manager(std::vector<NodePlan> plans, Options options, const od::Dictionary& dictionary,
          sdo::Arbiter& sdo, nmt::HeartbeatConsumer& heartbeats, EventLog& events, Host& host);
  ~Manager() override { services_.sdo.disown(*this); }

  // The start-up of the network: resets the nodes that are not to be kept alive, and boots all
  // nodes.
  void start(Instant now);
  void stop(Instant now);
  // Stops all nodes, including the own one, until start() or boot().
  void halt(Instant now) { stop_all(now); }
  // All nodes fall asleep: from now on none is expected to be heard, and none becomes missing. A
  // manager stops, and nothing starts or boots a node until wake(), which does not start it: all
  // nodes reset their communication by themselves then.
  void sleep(Instant now);
  // No node sends from now on: the states of the nodes are unknown until wake(), what a node still
  // sends included. Call it again when the silence is over.
  void fall_silent();
  void wake(Instant now);
  // The own node is no longer the NMT master (1F80h bit 0): the nodes are still observed, but not
  // controlled. keeps_data: the data of nodes that are Operational stay valid.
  void hand_over(Instant now, bool keeps_data = false);

  // Frames and losses of a node, 1..127, configured or not.
  void boot_up(std::uint8_t node, Instant now);
  void heartbeat(std::uint8_t node, nmt::State state, Instant now);
  void heartbeat_lost(std::uint8_t node, Instant now);
  void heartbeat_recovered(std::uint8_t node, Instant now);
  // The heartbeat consumer of the own node (1016h) lost the node.
  void consumer_lost(std::uint8_t node, Instant deadline);
  // A scan sent a request to the node at asked_at; answered: whether it answered. Frames received
  // after asked_at take precedence.
  void scanned(std::uint8_t node, bool answered, Instant asked_at, Instant now);
  void emergency(std::uint8_t node, std::uint16_t code, std::uint8_t error_register, Instant now);
  // sdo::TransferOwner, for the transfers of the boot processes.
  void completed(sdo::Completion& completion, Instant now) override;
  // An NMT command that a client requested was sent. node 0 = all. client: as in boot(), for the
  // boot processes that follow a reset.
  void commanded(nmt::Command command, std::uint8_t node, Instant now, std::uint32_t client = 0);
  // Another node sent this NMT command; node 0 = all.
  void heard(nmt::Command command, std::uint8_t node);
  // Nodes without error control that count as Operational once the bus has acknowledged their NMT
  // start, see Host::acknowledges_starts().
  bool starts_any() const { return starting_.any(); }
  bool starts(std::uint8_t node) const { return starting_[node]; }
  void start_acknowledged(std::uint8_t node);
  void start_dropped(std::uint8_t node) { starting_.reset(node); }
  // The bus acknowledged an NMT command that ends Operational. start_follows: a start of the node
  // was sent after it and is not acknowledged yet.
  void end_acknowledged(nmt::Command command, std::uint8_t node, bool start_follows);
  // An NMT command to a node, or to all with 0, was sent or received: the state changes that it
  // causes are not spontaneous, and a start before a reset does not determine the state after the
  // reset.
  void sent(nmt::Command command, std::uint8_t node, Instant now);
  // The own node was reset by a command: the network is started as after power-on. client: as in
  // boot().
  void own_reset(std::uint32_t client = 0);
  // Boots the node, or all with 0, again; resets it first unless it is to be kept alive. A node
  // that is not listed gets boot status A at once. client: whose frames those of the boot processes
  // are, see sdo::Pace, until each has reported its first result; 0 = nobody's.
  void boot(std::uint8_t node, Instant now, std::uint32_t client = 0);
  // Reserves the node for a program download: it is neither monitored nor booted until release(),
  // which boots it again. No effect on nodes that are not listed.
  void hold(std::uint8_t node);
  void release(std::uint8_t node, Instant now, std::uint32_t client = 0);
  // The network list (1F81h) was written: the node was added or removed.
  void list_changed(std::uint8_t node);
  // The node is reserved for a program download.
  bool held(std::uint8_t node) const { return held_[node]; }
  // Its error control can be monitored: a consumer time or guarding is configured.
  bool has_error_control(std::uint8_t node) const;
  // Its heartbeats or guard answers report its state: it is monitored, or has sent heartbeats since
  // its last boot-up message. Guard answers arrive only while a master sends requests.
  bool reports_state(std::uint8_t node) const {
    return nodes_[node].heartbeat_monitored || beats(node);
  }
  // 1F83h: starts or stops monitoring its error control.
  void watch(std::uint8_t node, bool wanted, Instant now);

  void advance(Instant now);
  Instant next_wake() const;

  // Sets the steps of every boot process, replacing existing ones; call it before start(). See
  // BootSlave::set_program() and set_configuration().
  using MakeStep = std::function<std::unique_ptr<BootStep>(std::uint8_t node)>;
  void set_program_step(MakeStep make);
  void set_configuration_step(MakeStep make);

  ManagerState state() const { return state_; }
  // id: 1..127. Nodes that were never heard and are not configured are unknown.
  const NodeState& node(std::uint8_t id) const { return nodes_[id]; }
  // Increases with every change of that NodeState.
  std::uint64_t revision(std::uint8_t id) const { return revisions_[id]; }
  // Increases with every change of any NodeState.
  std::uint64_t changes() const { return changes_; }
  // The last boot process that was started has reported its result.
  bool concluded(std::uint8_t id) const;
  // The node has the PDOs of the image, or gets them by its boot process in progress; otherwise its
  // next boot process compares them. false also for nodes that the manager does not boot.
  bool keeps_pdos(std::uint8_t id) const;
  // The node has, or may have, other PDOs than the image: its last boot process ended because of a
  // PDO, or no boot process has configured it since it was reset, restarted or found running.
  bool has_other_pdos(std::uint8_t id) const;
  // A boot process of the node is in progress.
  bool boots(std::uint8_t id) const;
  // Whose command caused the boot process of the node that is in progress; 0 = nobody's.
  std::uint32_t client_of(std::uint8_t id) const;
  std::uint8_t configured() const;
  std::uint8_t operational() const;
  // The manager controls the network: it was started, and neither stopped nor handed over.
  bool active() const {
    return state_ != ManagerState::inactive && state_ != ManagerState::stopped;
  }

 private:
  struct Slot {
    NodePlan plan;
    std::unique_ptr<BootSlave> boot;
    bool concluded = false;  // its boot process ended, successfully or not, at least once
    bool started = false;    // start was sent, or it was found Operational, since it was booted
    Instant reset_at{};      // time of the last reset command
    Instant not_started = kNever;  // deadline for Operational after NMT start
  };
  // The pending reaction to the loss of a mandatory node, or to a reset of the own node, ascending
  // by priority. advance() carries it out.
  enum class Reaction : std::uint8_t { none, restart, reset_all, stop_all };

  // --- manager.cpp ----------------------------------------------------------------------------
  bool beats(std::uint8_t node) const;
  Slot* find(std::uint8_t node) const;
  Slot& slot_of(NodePlan plan);
  void equip(Slot& slot);
  void look_for_twin(std::uint8_t node, nmt::State state, Instant now);
  void changed_itself(std::uint8_t node, nmt::State state, nmt::State before, Instant now);
  void expect_start(Slot& slot, Instant now);
  void end_start(Slot& slot, Instant now);
  void miss_start(Slot& slot, Instant now);
  void leave_error_control(const Slot& slot);
  void leave_unwatched(const Slot& slot, Instant now);
  void miss(std::uint8_t node, Presence presence);
  void expire(std::uint8_t node);
  void assume_state(std::uint8_t node, nmt::Command command, bool is_on_bus = false);
  // See fall_silent().
  nmt::State shown(nmt::State state) const { return silent_ ? nmt::State::unknown : state; }
  void touch(std::uint8_t node) {
    ++revisions_[node];
    ++changes_;
  }
  void refresh_list();

  // --- startup.cpp ----------------------------------------------------------------------------
  void end(Instant now, bool keeps_data);
  void boot_all(Instant now);
  void reset_nodes(Instant now);
  void begin(Slot& slot, BootSlave::Reason reason, Instant now,
             nmt::Command command = nmt::Command::reset_communication);
  void reset(Slot& slot, nmt::Command command, Instant now);
  void process_boot_result(Slot& slot, Instant now);
  void start_nodes(Instant now);
  void start_node(Slot& slot, Instant now);
  bool may_start(const Slot& slot) const;
  void react(Instant now);
  void stop_all(Instant now);
  bool leave_stop(Instant now);
  void boot_again(Slot& slot, Instant now);
  void boot_restarted(Instant now);
  bool failed_for_good(const Slot& slot) const;
  bool mandatory_booted() const;
  void release(Instant now);
  void update_state(Instant now);
  void set_state(ManagerState state, Instant now);

  Options options_;
  NetworkList list_;
  nmt::HeartbeatConsumer& heartbeats_;
  EventLog& events_;
  Host& host_;
  BootServices services_;
  MakeStep make_program_;
  MakeStep make_configuration_;
  ManagerState state_ = ManagerState::inactive;
  bool released_ = false;       // mandatory_nodes_booted() was called
  bool all_started_ = false;    // the nodes were started with one command (1F80h bit 1)
  bool time_is_over_ = false;   // boot time 1F89h is over
  bool asleep_ = false;         // see sleep()
  bool silent_ = false;         // see fall_silent()
  bool nodes_stopped_ = false;  // by an error event (1F80h bit 6)
  Reaction reaction_ = Reaction::none;
  std::uint32_t reaction_client_ = 0;  // whose command Reaction::restart follows
  Instant boot_deadline_ = kNever;
  std::vector<std::unique_ptr<Slot>> slots_;  // ascending by id
  std::array<NodeState, 128> nodes_;
  std::array<std::uint64_t, 128> revisions_{};
  std::uint64_t changes_ = 0;
  std::uint32_t client_ = 0;  // whose command is carried out, within boot() and commanded()
  std::bitset<128> held_;
  std::bitset<128> reset_;     // state unknown after a reset, and nothing received since
  std::bitset<128> starting_;  // without error control, and the NMT start is not acknowledged yet
  StateChanges causes_;
  SharedIds shared_;
  nmt::LifeSigns life_;  // of nodes whose error control is not monitored
};

}  // namespace linegate::manager
