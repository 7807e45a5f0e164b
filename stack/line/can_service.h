// SPDX-License-Identifier: Apache-2.0
// CommandKind::can_send and can_listen: frames that belong to no CANopen service (CANopenIA
// manual 6.2, 5F01h:0Bh). A can_send is answered when the bus acknowledged the frame. Private to
// stack/line.
#pragma once

#include <span>
#include <vector>

#include "stack/base/event_log.h"
#include "stack/line/generic_can.h"
#include "stack/line/service.h"
#include "stack/node/node.h"
#include "stack/pdo/link.h"

namespace linegate::line {

class CanService final : public Service {
 public:
  // node: sends the frames. linked: PDOs of the line. All must outlive the service.
  CanService(ServiceHost& host, node::Node& node, const std::vector<pdo::LinkedPdo>& linked,
             EventLog& events)
      : Service(host), node_(node), linked_(linked), events_(events) {}

  std::span<const CommandKind> commands() const override;
  bool needs_master() const override { return false; }
  // Refusals: see check_frame(), Listening::ask(); identifier_in_use, line_down, busy (the
  // transmit queue is full); no_acknowledge.
  void execute(Command command, Instant now) override;
  void advance(Instant /*now*/) override {}
  Instant next_wake() const override { return kNever; }
  // No command is under way, only frames.
  void end(Refusal /*why*/, Instant /*now*/) override {}

  // Queues the frame behind all others. Refusals as above.
  Error send(const can::Frame& frame);
  // Pass it each frame that no service of the node uses: see Listening::hear().
  void hear(const can::Frame& frame, bool all) { listening_.hear(frame, events_, all); }

 private:
  node::Node& node_;
  const std::vector<pdo::LinkedPdo>& linked_;
  EventLog& events_;
  Listening listening_;
};

}  // namespace linegate::line
