// SPDX-License-Identifier: Apache-2.0
// CommandKind::nmt: NMT commands of the operator (CiA 301 7.2.8.2.1), and of other services of the
// line. A command to other nodes is answered when the bus acknowledged its frame. Private to
// stack/line.
#pragma once

#include <cstdint>

#include "stack/line/service.h"
#include "stack/manager/manager.h"
#include "stack/nmt/master.h"
#include "stack/node/node.h"

namespace linegate::line {

// The interface of the line for its NMT service.
class NmtHost {
 public:
  NmtHost() = default;
  NmtHost(const NmtHost&) = delete;
  NmtHost& operator=(const NmtHost&) = delete;
  virtual ~NmtHost() = default;

  // The command was sent to that node, or to all with 0.
  virtual void nmt_sent(nmt::Command command, std::uint8_t node, Instant now) = 0;
  // Whether a fatal error stopped the network: a reset of the own node or of all nodes restarts it.
  virtual bool has_failed() const = 0;
};

class NmtService final : public Service {
 public:
  // node: the own node, with the node-ID own_node. All must outlive the service.
  NmtService(ServiceHost& host, NmtHost& nmt_host, nmt::Master& master, node::Node& node,
             manager::Manager& manager, std::uint8_t own_node)
      : Service(host),
        nmt_host_(nmt_host),
        master_(master),
        node_(node),
        manager_(manager),
        own_node_(own_node) {}

  std::span<const CommandKind> commands() const override;
  // Refusals: bad_request (no such command or node), wrong_state (the network sleeps), wrong_role
  // (not the own node, and the line is not NMT master), busy; awaits_turn (the inhibit time, 102Ah)
  // and no_acknowledge if the frame is not acknowledged in time.
  void execute(Command command, Instant now) override;
  void advance(Instant /*now*/) override {}
  Instant next_wake() const override { return kNever; }
  // Refuses the commands that wait for the inhibit time.
  void end(Refusal why, Instant now) override;
  void answer_unsent(FramesUnderWay::Sending& sending, Instant now) override;

  // Sends a command to the own node, to another node or to all others (0), like execute().
  // client: for the boot processes that follow a reset, see manager::Manager::commanded().
  Error send(nmt::Command command, std::uint8_t node, Instant now, std::uint32_t client = 0);
  // Sends a command to another node, or to all others with 0, that does not come from the manager.
  // Returns false if the queue is full, the line is not NMT master, or the network sleeps.
  bool send_to_others(nmt::Command command, std::uint8_t node, Instant now,
                      std::uint32_t client = 0);

 private:
  bool restarts_network(nmt::Command command, std::uint8_t node) const;

  NmtHost& nmt_host_;
  nmt::Master& master_;
  node::Node& node_;
  manager::Manager& manager_;
  const std::uint8_t own_node_;
};

}  // namespace linegate::line
