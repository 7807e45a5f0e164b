// SPDX-License-Identifier: Apache-2.0
// CommandKind::routing_trace, and the routing of a line with its own node (CiA 302-7), if the line
// takes part in it. Private to stack/line.
#pragma once

#include <memory>
#include <vector>

#include "stack/line/flying_master_service.h"
#include "stack/line/routing.h"
#include "stack/line/service.h"

namespace linegate::line {

class RoutingService final : public Service {
 public:
  // See Routing. The line takes part in routing if its configuration names an interface. All must
  // outlive it.
  RoutingService(ServiceHost& host, LineConfig& config, node::Node& node, sdo::Arbiter& arbiter,
                 EventLog& events, routing::MessageQueue& messages, routing::Counters& counters,
                 const sdo::WriteRule& rule, const FlyingMasterService& flying);

  // Whether the line takes part in routing; otherwise only execute() has an effect.
  bool takes_part() const { return routing_ != nullptr; }

  std::span<const CommandKind> commands() const override;
  // Refusals: wrong_role (the line does not take part), bad_request (the time is out of range).
  void execute(Command command, Instant now) override;
  bool needs_master() const override { return false; }
  void advance(Instant now) override;
  Instant next_wake() const override;
  // Closes all connections.
  void end(Refusal why, Instant now) override;

  // See Line::deliver(), set_routes(), routes().
  void deliver(const routing::Message& message, Instant now);
  void set_routes(const routing::Config& wanted);
  void routes(std::vector<routing::Route>& out) const;
  // See Line::set_present_gateways() and the functions that follow it.
  void set_present_gateways(std::vector<routing::GatewayLine> present);
  bool pop_gateway_request(routing::GatewayRequest& out);
  void answer_gateway_request(routing::GatewayAnswer answer, Instant now);
  // An EMCY of a node of this line was received.
  void emergency(std::uint8_t node, const emcy::Message& message, Instant now);
  // Call it after frames were received: passes messages between connections.
  void hand_on(Instant now);

  // Transfers with nodes of other networks, see routing::RemoteClient. Precondition: takes_part().
  void start(routing::RemoteRequest request, Instant now);
  void cancel(const sdo::TransferOwner& owner, std::uint64_t number, Instant now);
  bool may_be_carried_out(const sdo::TransferOwner& owner, std::uint64_t number) const;

 private:
  // Whether SDOs can be sent on the bus of this line: the own node is not stopped.
  bool may_send() const;

  LineConfig& config_;
  node::Node& node_;
  const FlyingMasterService& flying_;
  std::unique_ptr<Routing> routing_;
};

}  // namespace linegate::line
