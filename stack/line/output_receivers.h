// SPDX-License-Identifier: Apache-2.0
// The nodes that receive outputs: those that are known to be Operational. Follows NMT commands on
// their way to the bus, heartbeats and the manager, and makes the PDO engine send the outputs of
// nodes that were started. Private to stack/line.
#pragma once

#include <array>
#include <bitset>
#include <cstdint>

#include "stack/can/cob_id.h"
#include "stack/can/frame.h"
#include "stack/line/config.h"
#include "stack/line/ends_under_way.h"
#include "stack/line/flying_master_service.h"
#include "stack/line/service.h"
#include "stack/manager/host.h"
#include "stack/manager/manager.h"
#include "stack/nmt/master.h"
#include "stack/pdo/engine.h"

namespace linegate::line {

class OutputReceivers final : public Service {
 public:
  // The parts that it uses; all must outlive it.
  struct Parts {
    manager::Manager& manager;
    manager::Host& nmt;  // sends NMT commands
    const nmt::Master& master;
    pdo::Engine& pdos;
    const FlyingMasterService& flying;
  };
  OutputReceivers(ServiceHost& host, const LineConfig& config, const Parts& parts)
      : Service(host), config_(config), parts_(parts) {}

  bool needs_master() const override { return false; }
  // Repeats lost starts, then calls follow().
  void advance(Instant now) override;
  Instant next_wake() const override { return kNever; }
  void end(Refusal /*why*/, Instant /*now*/) override {}

  pdo::Engine::Receiver state(std::uint8_t node) const;
  // Whether a single value may be written: its receiver is known to be Operational with the PDOs of
  // the image, or its state is unknown. True for the own node.
  bool takes_single_writes(std::uint8_t node) const {
    const pdo::Engine::Receiver receiver = state(node);
    return node == config_.node_id || (receiver != pdo::Engine::Receiver::waiting &&
                                       receiver != pdo::Engine::Receiver::unlike);
  }

  // An input of state() other than the manager has changed: the bus, the role.
  void mark_changed() { changed_ = true; }
  // An NMT command is to be sent; node 0 = to all. A node that leaves Operational by it counts as
  // Operational again only after a state received later.
  void commanded(nmt::Command command, std::uint8_t node);
  // The same for a command of another master. It is on the bus before a start of the line that is
  // not acknowledged yet.
  void heard(nmt::Command command, std::uint8_t node);
  // The node was commanded to leave Operational.
  void expect_state(std::uint8_t node);
  // The node reported that state, or booted.
  void confirm(std::uint8_t node, nmt::State state, Instant now);
  // The values in the image of the node's outputs were not transmitted to it in its present state.
  void invalidate(std::uint8_t node);
  // Passes the states of the nodes to the PDO engine if any has changed.
  void follow();
  // The nodes that are known to have other PDOs than the image, as of the last follow(): what they
  // send is not that of the entries.
  const std::bitset<can::kMaxNodeId + 1>& unlike() const { return unlike_; }

  // A frame was handed to the bus with that number.
  void handed_out(const can::Frame& frame, std::uint64_t number) {
    if (frame.id == can::kNmtId) [[unlikely]] {
      note_nmt(frame, number);
    }
  }
  // The bus acknowledged the frames up to that number. A state that a node reported before a
  // command other than start was sent does not show that it is Operational after the command.
  void acknowledged(std::uint64_t number) {
    if (ends_.any() || has_end_.any()) [[unlikely]] {
      note_acknowledged_ends(number);
    }
    if (parts_.manager.starts_any()) [[unlikely]] {
      note_acknowledged_starts(number);
    }
  }
  // The frames first..last will never be sent. A lost start is repeated for nodes without error
  // control, which count as started when the bus acknowledged the command.
  void lost(std::uint64_t first, std::uint64_t last);

 private:
  static constexpr std::size_t kNodes = can::kMaxNodeId + 1;

  Duration heartbeat_time(std::uint8_t node) const;
  void follow_command(nmt::Command command, std::uint8_t node);
  // node 0: of all nodes
  void forget_start_frames(std::uint8_t node);
  void forget_lost_starts(std::uint8_t node);
  void note_nmt(const can::Frame& frame, std::uint64_t number);
  void note_acknowledged_ends(std::uint64_t number);
  void note_end(const EndsUnderWay::End& end);
  void note_acknowledged_starts(std::uint64_t number);
  void note_lost_ends(std::uint64_t first, std::uint64_t last);
  void note_lost_starts(std::uint64_t first, std::uint64_t last);
  void repeat_lost_starts(Instant now);

  const LineConfig& config_;
  Parts parts_;
  std::bitset<kNodes> unlike_;
  // By node: how many heartbeats must still report Operational, see commanded(), and when the last
  // of them was received.
  struct Unconfirmed {
    std::uint8_t heartbeats = 0;
    Instant heard{};
  };
  std::array<Unconfirmed, kNodes> unconfirmed_{};
  // By node: the frame number of the last NMT start to it, and whether that frame was lost.
  std::array<std::uint64_t, kNodes> start_frames_{};
  std::bitset<kNodes> lost_starts_;
  EndsUnderWay ends_;
  // By node: the frame number of the newest own NMT command to it, unless that is a start or was
  // acknowledged or lost.
  std::array<std::uint64_t, kNodes> newest_ends_{};
  std::bitset<kNodes> has_end_;
  bool changed_ = true;
  std::uint64_t changes_seen_ = 0;  // Manager::changes() at the last follow()
};

}  // namespace linegate::line
