// SPDX-License-Identifier: Apache-2.0
// Whether a node-ID is free, before LSS gives it to a device. Node-IDs are checked at the same
// time, each until an answer shows a device that uses it or its time has passed in silence.
//
// A node-ID is free if nothing was received on its identifiers of the pre-defined connection set
// (CiA 301 7.3.5) and SDO uploads of 1000h timed out: after NMT reset communication to it, where it
// may be sent; else node guarding was not answered, and the heartbeat time passed. An upload counts
// only if the bus acknowledged its request early enough for an answer. What is received later makes
// the node-ID used again. Private to stack/line.
#pragma once

#include <array>
#include <bitset>
#include <cstdint>
#include <span>
#include <vector>

#include "stack/base/time.h"
#include "stack/can/frame.h"
#include "stack/line/config.h"
#include "stack/manager/manager.h"
#include "stack/nmt/heartbeat_consumer.h"
#include "stack/pdo/link.h"
#include "stack/sdo/arbiter.h"

namespace linegate::line {

class NodeIdCheck {
 public:
  // cannot_ask: the own node is stopped, or the queue of SDO transfers with the node is full.
  enum class Use : std::uint8_t { unknown, checking, free, used, cannot_ask };

  // What it acts with; all must outlive it.
  struct Services {
    const manager::Manager& manager;
    sdo::Arbiter& sdo;
    nmt::HeartbeatConsumer& heartbeats;
    manager::Host& host;
  };
  // config must outlive it. owner: of its transfers; hands on their ends. inputs: the TPDOs of the
  // nodes; what one node sends on an identifier of another one's set says nothing about that one.
  NodeIdCheck(const LineConfig& config, const Services& services, sdo::TransferOwner& owner,
              std::span<const pdo::LinkedPdo> inputs);

  // Checks the node-ID, 1..127, unless that began already. before_boot: the manager has not reset
  // the nodes yet, so this node may be reset.
  void begin(std::uint8_t node, bool before_boot, Instant now);
  // unknown: begin() was not called since end().
  Use use(std::uint8_t node) const { return checks_[node].use; }
  // Forgets all.
  void end();

  // Frames have to be handed to hear().
  bool listens() const { return !begun_.empty(); }
  void hear(std::span<const can::Frame> frames);
  // The end of a transfer.
  void completed(const sdo::Completion& completion, Instant now);
  // The frame was given to the bus; number: as acknowledged() has it, 0 = it counts as acknowledged
  // at once.
  void handed_out(const can::Frame& frame, std::uint64_t number, Instant now);
  // Frames up to that number were acknowledged, or with lost() those in the range were not.
  void acknowledged(std::uint64_t number, Instant now);
  void lost(std::uint64_t first, std::uint64_t last);
  // An NMT command to a node, or all with 0, was sent or heard: a stopped node answers no SDO.
  void commanded(nmt::Command command, std::uint8_t node);
  // Its boot-up message came.
  void booted(std::uint8_t node) { stopped_.reset(node); }
  // The own node can ask: it is not stopped.
  bool may_ask() const;

 private:
  struct Check {
    Use use = Use::unknown;
    Duration time{};  // in which all that counts has to pass in silence
    Instant until{};
    std::uint64_t upload = 0;  // under way
    std::uint64_t number = 0;  // of its frame, while it is under way to the bus
    Instant sent = kNever;     // when its request was acknowledged
  };

  const NodeConfig* find(std::uint8_t node) const;
  bool may_reset(const NodeConfig* config) const;
  bool is_hidden(std::uint8_t node) const;
  Duration upload_time(const NodeConfig* config) const;
  void ask(std::uint8_t node, Instant now);
  void note_sent(std::uint8_t node, Instant now);

  const LineConfig& config_;
  Services services_;
  sdo::TransferOwner& owner_;
  std::vector<std::uint32_t> of_others_;  // identifiers, ascending
  std::array<Check, can::kMaxNodeId + 1> checks_{};
  std::vector<std::uint8_t> begun_;
  std::bitset<can::kMaxNodeId + 1> stopped_;  // by the last command
  std::uint64_t uploads_ = 0;
};

}  // namespace linegate::line
