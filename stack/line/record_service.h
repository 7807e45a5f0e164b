// SPDX-License-Identifier: Apache-2.0
// The CANopenIA records of the own dictionary (diagnosis/canopen_ia.h): the services of the line
// execute what is written to them. It has no commands. Private to stack/line.
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

// Orders of the records to other services.
class RecordOrders {
 public:
  RecordOrders() = default;
  RecordOrders(const RecordOrders&) = delete;
  RecordOrders& operator=(const RecordOrders&) = delete;
  virtual ~RecordOrders() = default;

  // Like CommandKind::nmt and pdo_trigger, without a reply. client: as Command::client.
  virtual void order_nmt(nmt::Command command, std::uint8_t node, Instant now,
                         std::uint32_t client) = 0;
  virtual void order_trigger(std::uint8_t node, std::uint8_t rpdo, Instant now) = 0;
  // See diagnosis::RecordHost.
  virtual AbortCode may_trigger(std::uint8_t node, std::uint8_t rpdo) const = 0;
};

class RecordService final : public Service, diagnosis::RecordHost {
 public:
  // The parts that it uses; all must outlive it.
  struct Parts {
    node::Node& node;
    const diagnosis::Diagnosis& diagnosis;
    manager::Host& nmt;  // sends NMT commands
    ScanService& scanning;
    RecordOrders& orders;
    const BusLoad& load;
    const pdo::LinkPlan& plan;
  };
  // Precondition: the dictionary of the node has diagnosis::add_canopen_ia().
  RecordService(ServiceHost& host, const LineConfig& config, const Parts& parts);

  bool needs_master() const override { return false; }
  // Executes the orders.
  void advance(Instant now) override;
  // The same for orders that a command of that client has written.
  void carry_out_orders(Instant now, std::uint32_t client);
  Instant next_wake() const override { return records_.waits() ? Instant{} : kNever; }
  void end(Refusal /*why*/, Instant /*now*/) override {}

  const diagnosis::ControlSettings& settings() const { return records_.settings(); }
  // Pass it each frame that no service uses. Returns true if all such frames are to be reported.
  bool hear(const can::Frame& frame) { return records_.hear(frame); }
  // A heartbeat of the node was received, and the manager has processed it.
  void heartbeat(std::uint8_t node, Instant now);
  // Writes the event and inhibit times of the records, if they were set, to all event-driven TPDOs.
  void apply_pdo_times();

 private:
  // diagnosis::RecordHost
  Transmission transmission() const override;
  AbortCode may_scan(std::uint8_t node) const override;
  AbortCode may_trigger(std::uint8_t node, std::uint8_t number) const override;
  AbortCode transmit(const can::Frame& frame) override;
  bool sleeps() const override { return host().sleeps(); }

  void carry_out(const diagnosis::CanopenIa::Order& order, Instant now, std::uint32_t client);

  const LineConfig& config_;
  Parts parts_;
  diagnosis::CanopenIa records_;
};

}  // namespace linegate::line
