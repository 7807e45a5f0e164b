// SPDX-License-Identifier: Apache-2.0
// The list of the services of a line with its own node. Private to stack/line.
#pragma once

#include "stack/line/boot_service.h"
#include "stack/line/can_service.h"
#include "stack/line/configure_service.h"
#include "stack/line/connection_service.h"
#include "stack/line/diagnosis_service.h"
#include "stack/line/emcy_service.h"
#include "stack/line/flying_master_service.h"
#include "stack/line/local_service.h"
#include "stack/line/lss_service.h"
#include "stack/line/mpdo_service.h"
#include "stack/line/nmt_service.h"
#include "stack/line/output_receivers.h"
#include "stack/line/output_service.h"
#include "stack/line/pdo_request_service.h"
#include "stack/line/pdo_write_rule.h"
#include "stack/line/program_service.h"
#include "stack/line/record_service.h"
#include "stack/line/routing_service.h"
#include "stack/line/scan_service.h"
#include "stack/line/sdo_service.h"
#include "stack/line/sleep_service.h"
#include "stack/line/srdo_service.h"

namespace linegate::line {

// The parts of the line that services use; all must outlive them.
struct LineParts {
  ServiceHost& host;
  NmtHost& nmt_host;
  manager::Host& nmt;  // sends NMT commands
  RecordOrders& orders;
  SleepHost& sleep_host;
  LineConfig& config;
  node::Node& node;
  image::ProcessImage& image;
  OwnObjects& own_objects;
  routing::ForwardObjects& forwarded;
  const pdo::LinkPlan& plan;
  nmt::Master& master;
  nmt::HeartbeatConsumer& heartbeats;
  sdo::Arbiter& sdo;
  manager::Configurator& configurator;
  manager::ProgramLoader& loader;
  manager::Manager& manager;
  EventLog& events;
  const BusLoad& load;
  routing::MessageQueue& messages;
  routing::Counters& routed;
};

// To add a service, include its header above and add a member below. The constructor of its base
// class reports it to the line, which passes it its commands, advances it, queries its next wake-up
// and ends it, see Service. A member that the line calls by name is an input or output of the line
// besides commands and time.
struct Services {
  explicit Services(const LineParts& parts) : line(parts) {}

  const LineParts line;

  // In the order in which they are advanced. A service that obtains a value from another service
  // when it is created follows it.
  FlyingMasterService flying{line.host,
                             line.config,
                             {.node = line.node,
                              .own_objects = line.own_objects,
                              .manager = line.manager,
                              .nmt_host = line.nmt_host,
                              .events = line.events}};
  NmtService nmt{line.host, line.nmt_host, line.master,
                 line.node, line.manager,  line.config.node_id};
  LssService lss{
      line.host,
      line.config,
      line.manager,
      {.manager = line.manager, .sdo = line.sdo, .heartbeats = line.heartbeats, .host = line.nmt},
      line.plan.rpdos,
      line.events};
  ScanService scan{line.host,
                   line.config,
                   {.sdo = line.sdo,
                    .manager = line.manager,
                    .nmt = line.nmt,
                    .diagnosing = diagnosis,
                    .records = records,
                    .events = line.events}};
  PdoWriteRule pdo_rule{line.config, line.node, line.manager, line.configurator};
  RoutingService routing{line.host,     line.config, line.node, line.sdo, line.events,
                         line.messages, line.routed, pdo_rule,  flying};
  EmcyService emcy{line.host, line.node};
  CanService can{line.host, line.node, line.plan.tpdos, line.events};
  LocalService local{line.host, line.node.dictionary(), line.own_objects, line.config};
  PdoRequestService pdo_request{line.host, line.node, line.image,
                                line.plan, flying,    line.config.sdo_timeout};
  BootService boot{line.host, line.manager, line.config.node_id};
  ConfigureService configure{line.host, line.manager, line.configurator, line.events};
  ConnectionService connections{line.host,       line.config, line.node,
                                line.plan.tpdos, line.sdo,    line.events};
  ProgramService program{line.host, line.manager, line.loader, line.config.node_id};
  DiagnosisService diagnosis{line.host, line.config, line.node, line.manager, scan, line.events};
  RecordService records{line.host,
                        line.config,
                        {.node = line.node,
                         .diagnosis = diagnosis.diagnosis(),
                         .nmt = line.nmt,
                         .scanning = scan,
                         .orders = line.orders,
                         .load = line.load,
                         .plan = line.plan}};
  SleepService sleep{line.host, line.sleep_host,    line.config.sleep,
                     line.node, records.settings(), line.events};
  SdoService sdo{line.host,
                 line.config,
                 {.sdo = line.sdo,
                  .node = line.node,
                  .image = line.image,
                  .rule = pdo_rule,
                  .routing = routing,
                  .flying = flying,
                  .cache = scan,
                  .local = local,
                  .settings = records.settings()}};
  SrdoService srdos{line.host,
                    line.config,
                    {.dispatch = line.node.dispatch(),
                     .events = line.events,
                     .engine = line.node.pdos(),
                     .image = line.image,
                     .rpdos = line.plan.rpdos,
                     .sdo = line.sdo,
                     .manager = line.manager}};
  MpdoService mpdo{line.host, line.node, line.own_objects, line.config, flying};
  OutputReceivers receivers{line.host,
                            line.config,
                            {.manager = line.manager,
                             .nmt = line.nmt,
                             .master = line.master,
                             .pdos = line.node.pdos(),
                             .flying = flying}};
  OutputService outputs{line.host,
                        line.config,
                        {.node = line.node,
                         .image = line.image,
                         .plan = line.plan,
                         .nmt = nmt,
                         .receivers = receivers,
                         .flying = flying,
                         .settings = records.settings(),
                         .forwarded = line.forwarded,
                         .routed = line.routed,
                         .events = line.events},
                        sdo};
};

}  // namespace linegate::line
