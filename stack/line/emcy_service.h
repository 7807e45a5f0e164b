// SPDX-License-Identifier: Apache-2.0
// CommandKind::emcy_send: an EMCY of the own node (CiA 301 7.2.7), answered when the bus
// acknowledged its frame. Private to stack/line.
#pragma once

#include "stack/line/service.h"
#include "stack/node/node.h"

namespace linegate::line {

class EmcyService final : public Service {
 public:
  // node: the own node; must outlive the service.
  EmcyService(ServiceHost& host, node::Node& node) : Service(host), node_(node) {}

  std::span<const CommandKind> commands() const override;
  bool needs_master() const override { return false; }
  // Refusals: wrong_state (the own node is stopped or
  // initialising, has no valid 1014h, or other errors remain), inhibited; awaits_turn and
  // no_acknowledge when the frame is not acknowledged in time.
  void execute(Command command, Instant now) override;
  void advance(Instant /*now*/) override {}
  Instant next_wake() const override { return kNever; }
  void end(Refusal why, Instant now) override;
  void answer_unsent(FramesUnderWay::Sending& sending, Instant now) override;
  void before_boot(Instant now) override;

 private:
  node::Node& node_;
};

}  // namespace linegate::line
