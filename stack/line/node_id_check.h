// SPDX-License-Identifier: Apache-2.0
// Checks whether a node-ID is free before LSS assigns it to a device. Node-IDs are checked in
// parallel, each until a response shows a device that uses it or its time has passed in silence.
//
// A node-ID is free if nothing was received on its identifiers of the pre-defined connection set
// (CiA 301 7.3.5) and SDO uploads of 1000h timed out: after NMT reset communication to it, where it
// may be sent; else node guarding was not answered, and the heartbeat time passed. An upload counts
// only if the bus acknowledged its request early enough for a response. A frame that is received
// later marks the node-ID as used again. Private to stack/line.
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

  // The services that the check uses; all must outlive it.
  struct Services {
    const manager::Manager& manager;
    sdo::Arbiter& sdo;
    nmt::HeartbeatConsumer& heartbeats;
    manager::Host& host;
  };
  // config must outlive it. owner: of the SDO transfers; must pass their completions to
  // completed(). inputs: the TPDOs of the nodes; a TPDO that a node sends on an identifier of
  // another node's connection set does not show that the other node-ID is used.
  NodeIdCheck(const LineConfig& config, const Services& services, sdo::TransferOwner& owner,
              std::span<const pdo::LinkedPdo> inputs);

  // Checks the node-ID, 1..127, unless its check has begun already. before_boot: the manager has
  // not reset the nodes yet, so this node may be reset. client: see sdo::Request::client.
  void begin(std::uint8_t node, bool before_boot, Instant now, std::uint32_t client = 0);
  // unknown: begin() was not called since end().
  Use use(std::uint8_t node) const { return checks_[node].use; }
  // Discards all checks and results.
  void end();

  // Whether frames must be passed to hear().
  bool listens() const { return !begun_.empty(); }
  void hear(std::span<const can::Frame> frames);
  // Call it with the end of each transfer.
  void completed(const sdo::Completion& completion, Instant now);
  // The frame was handed to the bus. number: as in acknowledged(), 0 = it counts as acknowledged
  // immediately.
  void handed_out(const can::Frame& frame, std::uint64_t number, Instant now);
  // The frames up to that number were acknowledged; with lost(), those in the range were lost.
  void acknowledged(std::uint64_t number, Instant now);
  void lost(std::uint64_t first, std::uint64_t last);
  // An NMT command to a node, or to all with 0, was sent or received: a stopped node does not
  // answer SDO.
  void commanded(nmt::Command command, std::uint8_t node);
  // The boot-up message of the node was received.
  void booted(std::uint8_t node) { stopped_.reset(node); }
  // Whether the own node can send requests: it is not stopped.
  bool may_ask() const;

 private:
  struct Check {
    Use use = Use::unknown;
    std::uint32_t client = 0;
    Duration time{};  // duration of silence that shows that the node-ID is free
    Instant until{};
    std::uint64_t upload = 0;  // SDO transfer under way
    std::uint64_t number = 0;  // of its frame until that is acknowledged
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
  std::vector<std::uint32_t> of_others_;  // identifiers of other nodes' TPDOs, ascending
  std::array<Check, can::kMaxNodeId + 1> checks_{};
  std::vector<std::uint8_t> begun_;
  std::bitset<can::kMaxNodeId + 1> stopped_;  // by the last NMT command
  std::uint64_t uploads_ = 0;
};

}  // namespace linegate::line
