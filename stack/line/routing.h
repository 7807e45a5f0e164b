// SPDX-License-Identifier: Apache-2.0
// The routing part of a line with its own node: its SDO servers as ingresses, its client SDOs as
// egresses, its commands as clients. Private to stack/line.
#pragma once

#include <memory>
#include <utility>
#include <vector>

#include "stack/line/config.h"
#include "stack/node/node.h"
#include "stack/routing/emcy_router.h"
#include "stack/routing/gateway_egress.h"
#include "stack/routing/remote_client.h"
#include "stack/routing/sdo_egress.h"
#include "stack/routing/sdo_ingress.h"
#include "stack/routing/table.h"
#include "stack/routing/usdo_egress.h"
#include "stack/sdo/arbiter.h"
#include "stack/sdo/server.h"

namespace linegate::line {

class Routing final : sdo::NetworkHandler {
 public:
  // Precondition: the dictionary of the node has 1F2Ch, see own_dictionary.h. All must outlive it.
  Routing(const LineConfig& config, node::Node& node, sdo::Arbiter& arbiter, EventLog& events,
          routing::MessageQueue& messages, routing::Counters& counters, const sdo::WriteRule& rule);
  ~Routing() override;

  // The configured routes, and with them the tables in the dictionary, have changed.
  void tables_changed();

  // An EMCY of a node of this line was received.
  void emergency(std::uint8_t node, const emcy::Message& message, Instant now) {
    emcys_.heard(node, message, now);
  }
  // usable: whether SDOs can be sent on the bus of this line.
  void deliver(const routing::Message& message, bool usable, Instant now);
  void start(routing::RemoteRequest request, bool usable, Instant now);
  void cancel(const sdo::TransferOwner& owner, std::uint64_t number, bool usable, Instant now);
  bool may_be_carried_out(const sdo::TransferOwner& owner, std::uint64_t number) const {
    return clients_.may_be_carried_out(owner, number);
  }
  // Delivers the completions of transfers that start() began.
  void deliver_completions(Instant now) { clients_.deliver_completions(now); }
  // Call it after any input: passes messages between the parts of the line.
  void hand_on(bool usable, Instant now);
  void advance(bool usable, Instant now);
  Instant next_wake() const;
  void stop(Instant now);
  // Reports connections that open before `end` as events, see routing::Trace.
  void trace_until(Instant end) { ingress_.trace_until(end); }
  // Requests to other gateways, see GatewayEgress.
  void set_present_gateways(std::vector<routing::GatewayLine> present) {
    gateways_.set_present(std::move(present));
  }
  bool pop_gateway_request(routing::GatewayRequest& out) { return gateways_.pop(out); }
  void answer_gateway_request(routing::GatewayAnswer answer, bool usable, Instant now);
  // Appends the routes of 1F2Ch to `out`.
  void routes(std::vector<routing::Route>& out) const;

 private:
  // An SDO server of the own node as the ingress of a client on the bus.
  class ServerSide;

  ServerSide& side_of(sdo::Server& server);
  void network_request(sdo::Server& server, std::uint64_t request, Instant now) override;
  void diverted_request(sdo::Server& server, std::uint64_t request, Instant now) override;
  void diverted_reset(sdo::Server& server) override;
  void receive_message(const routing::Message& message, Instant now);
  void enter(const routing::Message& message, Instant now);
  void set_usable(bool usable);

  node::Node& node_;
  const LineConfig& config_;
  routing::Post post_;
  routing::TableObject table_;
  routing::SdoIngress ingress_;
  routing::SdoEgress exit_;
  std::unique_ptr<routing::UsdoEgress> usdo_exit_;  // of a line of CANopen FD, to its devices
  routing::GatewayEgress gateways_;
  routing::RemoteClient clients_;
  routing::EmcyRouter emcys_;
  std::vector<std::unique_ptr<ServerSide>> sides_;
};

}  // namespace linegate::line
