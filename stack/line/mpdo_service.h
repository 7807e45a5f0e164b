// SPDX-License-Identifier: Apache-2.0
// CommandKind::mpdo_write: writes a value by MPDO in destination address mode (CiA 301 7.2.2.6);
// answered when the bus acknowledged the frame. Private to stack/line.
#pragma once

#include <cstdint>

#include "stack/line/config.h"
#include "stack/line/flying_master_service.h"
#include "stack/line/own_objects.h"
#include "stack/line/service.h"
#include "stack/node/node.h"
#include "stack/pdo/mpdo.h"

namespace linegate::line {

// A frame of that TPDO of the own node, with the identifier of its communication record.
can::Frame mpdo_frame(const od::Dictionary& dictionary, std::uint16_t tpdo,
                      const pdo::MpdoData& data);
// The MPDO of that TPDO that sends the object of the node in source address mode, with value 0.
can::Frame mpdo_frame(const od::Dictionary& dictionary, std::uint16_t tpdo, std::uint8_t node,
                      od::Address source);

class MpdoService final : public Service {
 public:
  // node: the own node. All must outlive the service.
  MpdoService(ServiceHost& host, node::Node& node, OwnObjects& own_objects,
              const LineConfig& config, const FlyingMasterService& flying)
      : Service(host), node_(node), own_objects_(own_objects), config_(config), flying_(flying) {}

  std::span<const CommandKind> commands() const override;
  bool needs_master() const override { return false; }
  // Answered with the number of the TPDO (2, LE). Refusals: unknown_entry (no such TPDO in
  // destination address mode), wrong_state (the own node is not Operational, or left it while the
  // value waited), bad_request (the length does not fit the mapped object), busy (too many wait),
  // wrong_role (another flying master is active); awaits_turn and no_acknowledge when the frame is
  // not acknowledged in time.
  void execute(Command command, Instant now) override;
  // Refuses waiting values after the own node left Operational: the PDO engine dropped them.
  void advance(Instant now) override;
  Instant next_wake() const override { return kNever; }
  // No command is under way, only frames.
  void end(Refusal /*why*/, Instant /*now*/) override {}
  void answer_unsent(FramesUnderWay::Sending& sending, Instant now) override;
  void before_boot(Instant now) override;

 private:
  std::uint16_t named_tpdo(const MpdoWrite& request) const;
  AbortCode queue(const MpdoWrite& request, std::uint16_t tpdo);

  node::Node& node_;
  OwnObjects& own_objects_;
  const LineConfig& config_;
  const FlyingMasterService& flying_;
  std::uint64_t starts_ = 0;  // starts of the own node at the last advance()
};

// The refusal of a command by PDO whose frames the bus did not acknowledge in time. own: state of
// the own node. stuck: the bus does not accept frames.
Refusal why_unsent(const FramesUnderWay::Sending& sending, nmt::State own, bool stuck);

}  // namespace linegate::line
