// SPDX-License-Identifier: Apache-2.0
// The CANopenIA records of the own dictionary (diagnosis/canopen_ia.h): what is written to them is
// carried out by the services of the line. It has no commands of its own. Private to stack/line.
#pragma once

#include "stack/diagnosis/canopen_ia.h"
#include "stack/line/bus_load.h"
#include "stack/line/config.h"
#include "stack/line/service.h"
#include "stack/manager/host.h"
#include "stack/node/node.h"
#include "stack/pdo/link.h"

namespace linegate::line {

class ScanService;

// What the records order of other services.
class RecordOrders {
 public:
  RecordOrders() = default;
  RecordOrders(const RecordOrders&) = delete;
  RecordOrders& operator=(const RecordOrders&) = delete;
  virtual ~RecordOrders() = default;

  // As CommandKind::nmt and pdo_trigger, without a reply.
  virtual void order_nmt(nmt::Command command, std::uint8_t node, Instant now) = 0;
  virtual void order_trigger(std::uint8_t node, std::uint8_t rpdo, Instant now) = 0;
  // As diagnosis::RecordHost.
  virtual AbortCode may_trigger(std::uint8_t node, std::uint8_t rpdo) const = 0;
};

class RecordService final : public Service, diagnosis::RecordHost {
 public:
  // What it acts with; all must outlive it.
  struct Parts {
    node::Node& node;
    const diagnosis::Diagnosis& diagnosis;
    manager::Host& nmt;  // sends NMT commands
    ScanService& scanning;
    RecordOrders& orders;
    const BusLoad& load;
    const pdo::LinkPlan& plan;
  };
  // The dictionary of the node has diagnosis::add_canopen_ia().
  RecordService(ServiceHost& host, const LineConfig& config, const Parts& parts);

  bool needs_master() const override { return false; }
  // Carries out what was ordered.
  void advance(Instant now) override;
  Instant next_wake() const override { return records_.waits() ? Instant{} : kNever; }
  void end(Refusal /*why*/, Instant /*now*/) override {}

  const diagnosis::ControlSettings& settings() const { return records_.settings(); }
  // A frame that no service wants: true if all such are to be reported.
  bool hear(const can::Frame& frame) { return records_.hear(frame); }
  // A heartbeat of the node came, and the manager has it.
  void heartbeat(std::uint8_t node, Instant now);
  // Event and inhibit time of the records, if they were written, become those of all event-driven
  // TPDOs.
  void apply_pdo_times();

 private:
  // diagnosis::RecordHost
  Transmission transmission() const override;
  AbortCode may_scan(std::uint8_t node) const override;
  AbortCode may_trigger(std::uint8_t node, std::uint8_t number) const override;
  AbortCode transmit(const can::Frame& frame) override;

  void carry_out(const diagnosis::CanopenIa::Order& order, Instant now);

  const LineConfig& config_;
  Parts parts_;
  diagnosis::CanopenIa records_;
};

}  // namespace linegate::line
