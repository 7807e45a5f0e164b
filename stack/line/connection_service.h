// SPDX-License-Identifier: Apache-2.0
// CommandKind::connection_open, connection_close and connection_list: SDO connections between two
// nodes, which the manager assigns (CiA 302-5). Private to stack/line.
#pragma once

#include <cstdint>
#include <vector>

#include "stack/line/config.h"
#include "stack/line/service.h"
#include "stack/manager/connections.h"
#include "stack/node/node.h"
#include "stack/pdo/link.h"

namespace linegate::line {

class ConnectionService final : public Service, manager::ConnectionHost {
 public:
  // All must outlive it. linked: the TPDOs of the line.
  ConnectionService(ServiceHost& host, const LineConfig& config, node::Node& node,
                    std::span<const pdo::LinkedPdo> linked, sdo::Arbiter& sdo, EventLog& events);

  std::span<const CommandKind> commands() const override;
  // connection_open is answered with its connection, connection_list with all. Refusals:
  // bad_request (no such node or connection, or the own node), wrong_role, wrong_state (no pool is
  // configured; the connection is being opened or released), line_down, busy (too many requests
  // wait), timed_out. Else the abort code of the device; sdo_connection: no free record or COB-ID.
  void execute(Command command, Instant now) override;
  void advance(Instant now) override { connections_.advance(now); }
  Instant next_wake() const override { return connections_.next_wake(); }
  // A line that stops releases its connections: is_ending() until that has ended.
  void end(Refusal why, Instant now) override;

  bool is_ending() const { return ending_ && !host().is_running() && connections_.busy(); }
  void boot_up(std::uint8_t node, Instant now);
  void heartbeat_recovered(std::uint8_t node, Instant now);
  // Pass it each frame that no service of the line uses.
  void hear(const can::Frame& frame) {
    if (!frame.extended()) {
      connections_.heard(frame.id, frame.time);
    }
  }

 private:
  // manager::ConnectionHost
  bool uses(std::uint32_t id) override;
  std::vector<std::uint16_t> records(std::uint8_t node, std::uint16_t first,
                                     std::uint16_t last) const override;
  void ended(std::uint32_t number, AbortCode why, bool expired, Instant now) override;

  Refusal open(const Command& command, Instant now);
  Refusal close(const Command& command, Instant now);

  struct Pending {
    std::uint32_t number = 0;  // of the connection
    std::uint64_t tag = 0;     // of the command
    bool opens = false;
  };

  const LineConfig& config_;
  node::Node& node_;
  std::span<const pdo::LinkedPdo> linked_;
  manager::Connections connections_;
  std::vector<Pending> pending_;
  bool ending_ = false;
};

}  // namespace linegate::line
