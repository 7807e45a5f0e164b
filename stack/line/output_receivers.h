// SPDX-License-Identifier: Apache-2.0
// Which nodes receive outputs: those that are known to be Operational. NMT commands on their way to
// the bus, heartbeats and the manager say which, and the PDO engine sends the outputs of those that
// were started. Private to stack/line.
#pragma once

#include <array>
#include <bitset>
#include <cstdint>

#include "stack/can/cob_id.h"
#include "stack/can/frame.h"
#include "stack/line/config.h"
#include "stack/line/ends_under_way.h"
#include "stack/line/service.h"
#include "stack/manager/host.h"
#include "stack/manager/manager.h"
#include "stack/nmt/master.h"
#include "stack/pdo/engine.h"

namespace linegate::line {

class OutputReceivers final : public Service {
 public:
  // What it follows and acts with; all must outlive it.
  struct Parts {
    manager::Manager& manager;
    manager::Host& nmt;  // sends NMT commands
    const nmt::Master& master;
    pdo::Engine& pdos;
  };
  OutputReceivers(ServiceHost& host, const LineConfig& config, const Parts& parts)
      : Service(host), config_(config), parts_(parts) {}

  bool needs_master() const override { return false; }
  // Sends lost starts again, then follow().
  void advance(Instant now) override;
  Instant next_wake() const override { return kNever; }
  void end(Refusal /*why*/, Instant /*now*/) override {}

  pdo::Engine::Receiver state(std::uint8_t node) const;
  // A single value may be written: its receiver is known to be Operational, or nothing is known of
  // it. True for the own node.
  bool takes_single_writes(std::uint8_t node) const {
    return node == config_.node_id || state(node) != pdo::Engine::Receiver::waiting;
  }

  // What state() depends on beside the manager has changed: the bus, the role.
  void mark_changed() { changed_ = true; }
  // An NMT command was sent, or received of another master; node 0 = to all. A node that leaves
  // Operational by it counts as Operational only when its state was received since then.
  void commanded(nmt::Command command, std::uint8_t node);
  // The node was commanded to leave Operational.
  void expect_state(std::uint8_t node);
  // The node reported that state, or booted.
  void confirm(std::uint8_t node, nmt::State state, Instant now);
  // What is in the image of its outputs was not transmitted to the node as it is now.
  void invalidate(std::uint8_t node);
  // Hands the states of the nodes to the PDO engine, if any has changed.
  void follow();

  // A frame was handed out with that number.
  void handed_out(const can::Frame& frame, std::uint64_t number) {
    if (frame.id == can::kNmtId) [[unlikely]] {
      note_nmt(frame, number);
    }
  }
  // The bus acknowledged the frames up to that number: what was received of a node before a command
  // other than start to it was on the bus does not show that it is Operational after the command.
  void acknowledged(std::uint64_t number) {
    if (has_end_.any()) [[unlikely]] {
      note_acknowledged_ends(number);
    }
    if (parts_.manager.starts_any()) [[unlikely]] {
      note_acknowledged_starts(number);
    }
  }
  // The frames first..last never get onto the bus. Of nodes without error control, which are
  // started when the bus acknowledged the command, a start among them is sent again.
  void lost(std::uint64_t first, std::uint64_t last);

 private:
  static constexpr std::size_t kNodes = can::kMaxNodeId + 1;

  Duration heartbeat_time(std::uint8_t node) const;
  void forget_starts(std::uint8_t node);  // 0: of all
  void note_nmt(const can::Frame& frame, std::uint64_t number);
  void note_acknowledged_ends(std::uint64_t number);
  void note_end(const nmt::NodeControl& control);
  void note_acknowledged_starts(std::uint64_t number);
  void note_lost_ends(std::uint64_t first, std::uint64_t last);
  void note_lost_starts(std::uint64_t first, std::uint64_t last);
  void repeat_lost_starts(Instant now);

  const LineConfig& config_;
  Parts parts_;
  // By node: how many heartbeats have to report Operational, see commanded(), and when the last one
  // of them did.
  struct Unconfirmed {
    std::uint8_t heartbeats = 0;
    Instant heard{};
  };
  std::array<Unconfirmed, kNodes> unconfirmed_{};
  // By node: the frame of the last NMT command start to it, and whether the bus lost that.
  std::array<std::uint64_t, kNodes> start_frames_{};
  std::bitset<kNodes> lost_starts_;
  EndsUnderWay ends_;
  // By node: the newest own NMT command to it that was handed out, unless that is a start or was
  // acknowledged or lost: the number of its frame.
  std::array<std::uint64_t, kNodes> newest_ends_{};
  std::bitset<kNodes> has_end_;
  bool changed_ = true;
  std::uint64_t changes_seen_ = 0;  // Manager::changes() in follow()
};

}  // namespace linegate::line
