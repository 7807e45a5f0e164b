// SPDX-License-Identifier: Apache-2.0
// The services of a manager that use each other: diagnosis, records and scan, without a line.
#pragma once

#include <utility>
#include <vector>

#include "stack/line/diagnosis_service.h"
#include "stack/line/record_service.h"
#include "stack/line/scan_service.h"

#include "tests/stack/line/service_fixture.h"

namespace linegate::line {

// A network with node 5 in its network list. No device answers unless the test does.
struct DiagnosedParts final : manager::Host, RecordOrders {
  DiagnosedParts() {
    node.start(now);
    manager.start(now);
  }

  // manager::Host
  void node_data_invalid(std::uint8_t /*id*/) override {}
  void mandatory_nodes_booted(Instant /*at*/) override {}
  void send_nmt(nmt::Command /*command*/, std::uint8_t /*id*/, Instant /*at*/) override {}
  bool acknowledges_starts() const override { return false; }
  void command_own(nmt::Command command, Instant at) override { node.command(command, at); }
  nmt::State own_state() const override { return node.state(); }
  // RecordOrders
  void order_nmt(nmt::Command command, std::uint8_t id, Instant /*at*/,
                 std::uint32_t /*client*/) override {
    ordered_nmt.emplace_back(command, id);
  }
  void order_trigger(std::uint8_t id, std::uint8_t rpdo, Instant /*at*/) override {
    ordered_triggers.emplace_back(id, rpdo);
  }
  AbortCode may_trigger(std::uint8_t /*id*/, std::uint8_t /*rpdo*/) const override {
    return AbortCode::none;
  }

  od::Dictionary make_dictionary() {
    od::Dictionary out = make_own_dictionary(config);
    EXPECT_TRUE(pdo::add_linked_objects(out, image, plan).ok());
    EXPECT_TRUE(diagnosis::add_objects(out).ok());
    EXPECT_TRUE(diagnosis::add_canopen_ia(out, config.canopen_ia_base).ok());
    return out;
  }

  std::vector<std::pair<nmt::Command, std::uint8_t>> ordered_nmt;
  std::vector<std::pair<std::uint8_t, std::uint8_t>> ordered_triggers;

  Instant now{seconds(10)};
  LineConfig config = config_with_axis();
  RecordingHost host;
  EventLog events;
  BusLoad load{config.bit_rate};
  pdo::LinkPlan plan = *link_plan(config).value;
  image::ProcessImage image{plan.inputs, plan.outputs};
  node::Node node{make_dictionary(),
                  {.node_id = config.node_id,
                   .self_starting = false,
                   .nmt_slave = false,
                   .clients_of_default_servers = false},
                  events,
                  &image};
  nmt::HeartbeatConsumer heartbeats{node.dispatch(), events, can::kMaxNodeId + 1};
  sdo::Arbiter sdo{node.dispatch(), node.transmit(), events};
  manager::Manager manager{node_plans(config),
                           manager_options(config),
                           node.dictionary(),
                           sdo,
                           heartbeats,
                           events,
                           *this};
  ScanService scanning{host,
                       config,
                       {.sdo = sdo,
                        .manager = manager,
                        .nmt = *this,
                        .diagnosing = diagnosing,
                        .records = records,
                        .events = events}};
  DiagnosisService diagnosing{host, config, node, manager, scanning, events};
  RecordService records{host,
                        config,
                        {.node = node,
                         .diagnosis = diagnosing.diagnosis(),
                         .nmt = *this,
                         .scanning = scanning,
                         .orders = *this,
                         .load = load,
                         .plan = plan}};
};

}  // namespace linegate::line
