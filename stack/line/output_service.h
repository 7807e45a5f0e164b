// SPDX-License-Identifier: Apache-2.0
// The outputs of a line with its own node: groups with their watchdogs, single values
// (CommandKind::output_write, and object_write if a PDO carries the object, CANopenIA manual 5.1),
// values that follow inputs of other lines, and PDOs that are triggered by command
// (CommandKind::pdo_trigger, IXXAT CANopen Manager API manual 6.1.6). Private to stack/line.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "stack/base/event_log.h"
#include "stack/diagnosis/control_record.h"
#include "stack/image/process_image.h"
#include "stack/line/config.h"
#include "stack/line/flying_master_service.h"
#include "stack/line/nmt_service.h"
#include "stack/line/output_receivers.h"
#include "stack/line/output_state.h"
#include "stack/line/output_write.h"
#include "stack/line/outputs.h"
#include "stack/line/own_outputs.h"
#include "stack/line/pdo_updates.h"
#include "stack/line/service.h"
#include "stack/node/node.h"
#include "stack/pdo/link.h"
#include "stack/routing/forward_objects.h"
#include "stack/routing/message.h"

namespace linegate::line {

class OutputService final : public Service {
 public:
  // The parts that it uses; all must outlive it.
  struct Parts {
    node::Node& node;  // the own node
    image::ProcessImage& image;
    const pdo::LinkPlan& plan;
    NmtService& nmt;
    const OutputReceivers& receivers;
    const FlyingMasterService& flying;
    const diagnosis::ControlSettings& settings;
    routing::ForwardObjects& forwarded;
    routing::Counters& routed;
    EventLog& events;
  };
  // by_sdo: executes an object_write for which there is no PDO.
  OutputService(ServiceHost& host, const LineConfig& config, const Parts& parts, Service& by_sdo);

  std::span<const CommandKind> commands() const override;
  bool needs_master() const override { return false; }
  // output_write: see check_single_output(); wrong_state (the node is not Operational).
  // object_write: bad_request, wrong_state, bound_entry. Both: wrong_state with the number of the
  // group (2 bytes, little-endian) in the reply, if its watchdog has fired.
  // pdo_trigger: answered with the numbers of the TPDOs; wrong_state (the own node is not
  // Operational, or a value of each PDO is missing), unknown_entry. If a frame is not acknowledged
  // in time, the reply to a write has the reason why its PDO waits, and pdo_trigger is refused with
  // why_unsent(). A write to an object of several PDOs is answered as sent when all of their frames
  // were acknowledged, otherwise with the worst reason. All: wrong_role, while another flying
  // master is active.
  void execute(Command command, Instant now) override;
  // Requests PDOs whose update time has passed.
  void advance(Instant now) override;
  Instant next_wake() const override { return updates_.next_wake(); }
  // No command is under way, only frames.
  void end(Refusal /*why*/, Instant /*now*/) override {}
  void answer_unsent(FramesUnderWay::Sending& sending, Instant now) override;
  void before_boot(Instant now) override;

  // --- values ---------------------------------------------------------------------------------
  // See Line::write_outputs().
  OutputRefusal write(const OutputWrite& write, Instant now);
  // See Line::feed_watchdog().
  bool feed_watchdog(const OutputWrite& write, Instant now);
  // See Line::write_bound().
  void write_bound(std::span<const BoundValue> values, Instant now);
  void apply_defaults(Instant now);
  // Those that are objects of the own node.
  OwnOutputs& own() { return own_; }
  // Another flying master is active: disarms all groups, forgets the values that clients wrote, so
  // that their PDOs are held back until they are written again, and refuses commands under way.
  void give_up(Instant now);
  // Executes the reactions of watchdogs that have expired.
  void expire_watchdogs(Instant now);
  Instant next_watchdog() const { return outputs_.next_wake(); }

  const std::vector<Outputs::Group>& groups() const { return outputs_.groups(); }
  // See Line::output_state().
  void describe(std::size_t position, OutputState& out, Instant now) const;
  void note_refused(const event::OutputRefused& refused, Instant now) {
    outputs_.note_refused(refused, {}, now);
  }

  // --- PDOs that are triggered by hand ----------------------------------------------------------
  // Appends the TPDOs to `triggered`. PDOs that lack a value are not sent.
  Error trigger(const PdoTrigger& what, std::vector<std::uint16_t>& triggered, Instant now);
  // See diagnosis::RecordHost.
  AbortCode may_trigger(const PdoTrigger& what) const;

 private:
  void write_entry(Command command, Instant now);
  void write_object(Command command, Instant now);
  void write_by_pdo(Command command, std::span<const std::uint32_t> entries, Instant now);
  Refusal check_by_pdo(const ObjectWrite& request, std::span<const std::uint32_t> entries) const;
  std::optional<std::uint32_t> own_entry_of(const Command& command) const;
  void refuse_fired(const Command& command, std::uint32_t entry, Instant now);
  void answer_write(Command command, std::span<const std::uint16_t> tpdos, bool keep, Instant now);
  void answer_own(Command command, std::uint32_t entry, bool keep, Instant now);
  void answer_trigger(Command command, Instant now);
  bool asks_at_once(std::uint16_t tpdo) const;
  PdoWait wait_of(std::uint16_t tpdo) const;
  WrittenByPdo way_of(std::uint16_t tpdo, PdoWait wait) const;
  WrittenByPdo way_of_unsent(std::span<const FramesUnderWay::Awaited> frames, bool stuck) const;
  std::vector<std::uint16_t> tpdos_of(const PdoTrigger& what) const;
  void request_updated(Instant now);
  void apply(const OutputWrite& write, bool always, Instant now);
  // Outputs were written there: requests their PDOs and MPDOs. always: for unchanged values, too.
  void written(std::uint32_t bit_offset, std::uint32_t bits, bool always, Instant now);
  void entry_written(std::uint32_t entry, bool always, Instant now) {
    entries_written(entry, entries()[entry].bit_length, always, now);
  }
  // Adjacent entries of one PDO: `bits` bits from the start of entry `first`.
  void entries_written(std::uint32_t first, std::uint32_t bits, bool always, Instant now);
  void write_bound_entry(const BoundValue& value);
  void request_forwarded(std::span<const BoundValue> values, Instant now);
  OutputWait reason_of(std::uint32_t entry, Instant now) const;
  void note_if_complete(const Outputs::Group& group);
  void react(const Outputs::Group& group, Instant now);
  void zero(const Outputs::Group& group, Instant now);
  const std::vector<image::Entry>& entries() const {
    return parts_.image.layout(image::Direction::outputs).entries;
  }

  const LineConfig& config_;
  Parts parts_;
  Service& by_sdo_;
  Outputs outputs_;
  OwnOutputs own_;
  PdoUpdates updates_;
};

// Positions in the layout of the entries of that object of the node, ascending.
std::vector<std::uint32_t> entries_of(const image::Layout& layout, std::uint8_t node,
                                      od::Address address);

}  // namespace linegate::line
