// SPDX-License-Identifier: Apache-2.0
// A flying master (CiA 302-2): the nodes of a network that can be its NMT master negotiate which of
// them is the active one, and again when it is lost. The README has the table of states.
//
//   071h  active master: priority (0 is the highest), node-ID     074h  answer to 075h
//   072h  start of the negotiation                                075h  any master-capable node?
//   073h  is there an active master?                              076h  force a new negotiation
//
// This class only tracks the state: its owner takes and gives up the role of the NMT master, and
// monitors the heartbeat of the active master. The frames are evaluated at their own times.
#pragma once

#include <compare>
#include <cstdint>
#include <optional>

#include "stack/base/time.h"
#include "stack/can/frame.h"
#include "stack/nmt/node_control.h"
#include "stack/nmt/state.h"

namespace linegate::nmt {

// The identifiers.
inline constexpr std::uint16_t kActiveMasterId = 0x071;
inline constexpr std::uint16_t kStartNegotiationId = 0x072;
inline constexpr std::uint16_t kDetectMasterId = 0x073;
inline constexpr std::uint16_t kCapableAnswerId = 0x074;
inline constexpr std::uint16_t kCapableQuestionId = 0x075;
inline constexpr std::uint16_t kForceNegotiationId = 0x076;

inline constexpr std::uint8_t kLowestMasterPriority = 2;
// A master whose heartbeat arrives is active no longer if it does not answer that many questions.
inline constexpr unsigned kUnansweredQuestions = 3;

// The message that the active master sends every detect cycle, to find a second one.
enum class MasterDetection : std::uint8_t {
  ask,    // 073h: a second master answers
  force,  // 076h: all other nodes search for the active master again
};

// 1F90h.
struct FlyingMasterTimes {
  Duration master_timeout = std::chrono::milliseconds(100);     // 1: for the answer to 073h
  Duration negotiation_delay = std::chrono::milliseconds(500);  // 2: before 073h
  std::uint8_t priority = kLowestMasterPriority;                // 3: 0..2, 0 is the highest
  Duration priority_slot = std::chrono::milliseconds(1500);     // 4
  Duration device_slot = std::chrono::milliseconds(10);         // 5
  Duration detect_cycle = std::chrono::milliseconds(4000);      // 6: more than 0
};

// The order of masters: the lower is the one that remains, if there are two.
struct MasterRank {
  std::uint8_t priority = 0;  // 0..2
  std::uint8_t node = 0;      // 1..127

  friend constexpr auto operator<=>(const MasterRank&, const MasterRank&) = default;
};

// Returns nothing if the frame is not a data frame of 2 bytes with a priority and a node-ID.
std::optional<MasterRank> decode_active_master(const can::Frame& frame);

class FlyingMasterHost {
 public:
  virtual ~FlyingMasterHost() = default;
  // 071h to 076h.
  virtual void send_master_message(const can::Frame& frame, Instant now) = 0;
  // Sends the NMT command reset communication to all nodes. Returns false, without sending it, if a
  // node is to be kept alive.
  virtual bool reset_all(Instant now) = 0;
  // The state or the active master is another one.
  virtual void flying_master_changed(FlyingMasterState before, Instant now) = 0;
  // Whether the heartbeat of the active master is monitored: its loss is reported.
  virtual bool monitors_master() const { return false; }
};

class FlyingMaster {
 public:
  // host must outlive this object. own_node: 1..127.
  FlyingMaster(FlyingMasterHost& host, std::uint8_t own_node) : host_(host), own_node_(own_node) {}

  // They apply to the next waits.
  void set_times(const FlyingMasterTimes& times) { times_ = times; }
  const FlyingMasterTimes& times() const { return times_; }
  void set_detection(MasterDetection detection) { detection_ = detection; }

  // Searches for the active master. after_power_on: if there is none, all nodes are reset once;
  // also when the active master was lost. Else the own node was reset by an NMT command.
  void start(bool after_power_on, Instant now);
  // It is no flying master any more.
  void stop(Instant now);

  // Processes a frame of another node with one of the identifiers. Returns false if it is
  // malformed.
  bool receive(const can::Frame& frame);
  // Another node sent this NMT command.
  void node_control(const NodeControl& control, Instant now);
  // A node sent its boot-up message.
  void boot_up(Instant now);
  // A node sent its heartbeat.
  void heartbeat(std::uint8_t node, Instant now) { heard_ = node == active_ ? now : heard_; }
  // The heartbeat of that node was lost.
  void heartbeat_lost(std::uint8_t node, Instant now);

  void advance(Instant now);
  Instant next_wake() const { return deadline_; }

  FlyingMasterState state() const { return state_; }
  bool is_master() const { return state_ == FlyingMasterState::master; }
  // The node-ID of the active master, 0 = not known.
  std::uint8_t active_master() const { return active_; }
  MasterRank own_rank() const { return {times_.priority, own_node_}; }

 private:
  // The waits in FlyingMasterState::detect, reset and force, and that of a slave for the answer.
  enum class Wait : std::uint8_t { delay, answer };

  void enter(FlyingMasterState state, std::uint8_t active, Instant wake, Instant now);
  void search(FlyingMasterState state, Instant now);
  void ask(Instant now);
  void found_none(Instant now);
  void master_is_silent(Instant now);
  void negotiate(Instant now);
  void become_master(Instant now);
  void follow(std::uint8_t master, Instant now);
  void force(Instant now);
  void force_others(Instant now);
  void active_master(const MasterRank& other, Instant now);
  void indicate(Instant now);
  void send(std::uint16_t id, Instant now);

  FlyingMasterHost& host_;
  std::uint8_t own_node_;
  FlyingMasterTimes times_;
  MasterDetection detection_ = MasterDetection::ask;
  FlyingMasterState state_ = FlyingMasterState::none;
  Wait wait_ = Wait::delay;
  std::uint8_t active_ = 0;
  bool resets_ = false;  // if it finds no master: it has not reset the nodes yet
  Instant deadline_ = kNever;
  Instant indicated_{};      // when it sent 071h
  Instant forced_{};         // when it sent 076h as the active master
  Instant asked_{};          // when it sent 073h last
  Instant heard_{};          // the last heartbeat of the active master that it follows
  unsigned unanswered_ = 0;  // questions of a slave in sequence
};

}  // namespace linegate::nmt
