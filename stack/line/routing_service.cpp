// SPDX-License-Identifier: Apache-2.0
#include "stack/line/routing_service.h"

#include <array>
#include <utility>

#include "stack/base/assert.h"
#include "stack/line/own_dictionary.h"
#include "stack/nmt/services.h"

namespace linegate::line {

RoutingService::RoutingService(ServiceHost& host, LineConfig& config, node::Node& node,
                               sdo::Arbiter& arbiter, EventLog& events,
                               routing::MessageQueue& messages, routing::Counters& counters,
                               const sdo::WriteRule& rule, const FlyingMasterService& flying)
    : Service(host), config_(config), node_(node), flying_(flying) {
  if (config.routing.interface != 0) {
    routing_ = std::make_unique<Routing>(config, node, arbiter, events, messages, counters, rule);
  }
}

std::span<const CommandKind> RoutingService::commands() const {
  static constexpr std::array kCommands{CommandKind::routing_trace};
  return kCommands;
}

void RoutingService::execute(Command command, Instant now) {
  const Duration duration = std::get<RoutingTrace>(command.request).duration;
  if (!takes_part()) {
    host().refuse(command, Refusal::wrong_role, now);
  } else if (duration < std::chrono::seconds(1) ||
             duration > std::chrono::seconds(routing::Trace::kLongest)) {
    host().refuse(command, Refusal::bad_request, now);
  } else {
    routing_->trace_until(now + duration);
    host().reply(command.tag, Error{}, {});
  }
}

void RoutingService::advance(Instant now) {
  if (takes_part()) {
    routing_->advance(may_send(), now);
    routing_->deliver_completions(now);
  }
}

Instant RoutingService::next_wake() const {
  return takes_part() ? routing_->next_wake() : kNever;
}

void RoutingService::end(Refusal /*why*/, Instant now) {
  if (takes_part()) {
    routing_->stop(now);
    routing_->deliver_completions(now);
  }
}

void RoutingService::deliver(const routing::Message& message, Instant now) {
  if (takes_part()) {
    routing_->deliver(message, may_send(), now);
    routing_->deliver_completions(now);
  }
}

void RoutingService::set_routes(const routing::Config& wanted) {
  if (!takes_part()) {
    return;
  }
  config_.routing.interfaces = wanted.interfaces;
  config_.routing.routes = wanted.routes;
  config_.routing.emcy_networks = wanted.emcy_networks;
  for (const od::ObjectDescription& table : routing_tables(config_)) {
    (void)node_.dictionary().remove(table.index);
    (void)node_.dictionary().add(table);
  }
  routing_->tables_changed();
}

void RoutingService::routes(std::vector<routing::Route>& out) const {
  if (takes_part()) {
    routing_->routes(out);
  }
}

void RoutingService::set_present_gateways(std::vector<routing::GatewayLine> present) {
  if (takes_part()) {
    routing_->set_present_gateways(std::move(present));
  }
}

bool RoutingService::pop_gateway_request(routing::GatewayRequest& out) {
  return takes_part() && routing_->pop_gateway_request(out);
}

void RoutingService::answer_gateway_request(routing::GatewayAnswer answer, Instant now) {
  if (takes_part()) {
    routing_->answer_gateway_request(std::move(answer), may_send(), now);
    routing_->deliver_completions(now);
  }
}

void RoutingService::emergency(std::uint8_t node, const emcy::Message& message, Instant now) {
  if (takes_part()) {
    routing_->emergency(node, message, now);
  }
}

void RoutingService::hand_on(Instant now) {
  if (takes_part()) {
    routing_->hand_on(may_send(), now);
    routing_->deliver_completions(now);
  }
}

void RoutingService::start(routing::RemoteRequest request, Instant now) {
  LINEGATE_ASSERT(takes_part(), "the line routes");
  LINEGATE_ASSERT(takes_part(), "the line takes part in routing");
  routing_->start(std::move(request), may_send(), now);
  routing_->deliver_completions(now);
}

void RoutingService::cancel(const sdo::TransferOwner& owner, std::uint64_t number, Instant now) {
  if (takes_part()) {
    routing_->cancel(owner, number, may_send(), now);
  }
}

bool RoutingService::may_be_carried_out(const sdo::TransferOwner& owner,
                                        std::uint64_t number) const {
  return takes_part() && routing_->may_be_carried_out(owner, number);
}

bool RoutingService::may_send() const {
  // The SDO servers of the nodes are the active flying master's.
  return !flying_.is_passive() && host().is_running() && host().usable() &&
         nmt::is_served(can::Service::sdo_client, node_.state());
}

}  // namespace linegate::line
