// SPDX-License-Identifier: Apache-2.0
#include "stack/line/routing.h"

#include <algorithm>

#include "stack/base/assert.h"
#include "stack/od/data_type.h"
#include "stack/od/objects.h"

namespace linegate::line {
namespace {

// Bytes of the value of an object in the device file of the node; 0 = unknown, or of any length.
std::size_t described_size(const LineConfig& config, std::uint8_t node, od::Address address) {
  const auto found = std::ranges::find(config.nodes, node, &NodeConfig::id);
  const od::VariableDescription* const variable =
      found != config.nodes.end() ? found->device.find(address) : nullptr;
  return variable != nullptr ? od::byte_size(variable->type) : 0;
}

}  // namespace

class Routing::ServerSide final : public routing::ClientSide {
 public:
  ServerSide(sdo::Server& server, can::TransmitQueue& transmit)
      : server_(server), transmit_(transmit) {}

  bool is(const sdo::Server& server) const { return &server_ == &server; }
  bool response(std::uint64_t word, Instant /*now*/) override {
    return server_.respond(word, transmit_);
  }
  void released(Instant /*now*/) override { server_.divert(false); }
  bool on_bus() const override { return true; }
  bool is_device() const override { return true; }

 private:
  sdo::Server& server_;
  can::TransmitQueue& transmit_;
};

Routing::Routing(const LineConfig& config, node::Node& node, sdo::Arbiter& arbiter,
                 EventLog& events, routing::MessageQueue& messages, routing::Counters& counters,
                 const sdo::WriteRule& rule)
    : node_(node),
      config_(config),
      post_(config.routing.interface, messages),
      table_(node.dictionary(), config.routing.interfaces),
      ingress_(config.routing, {config.network_id, config.node_id, config.sdo_timeout},
               node.dictionary(), post_, events, counters),
      exit_(config.routing, {config.network_id, config.node_id, config.sdo_timeout},
            node.dictionary(), arbiter, node.transmit(), post_, events, counters),
      gateways_(config.routing, config.sdo_timeout, post_, events, counters),
      clients_(ingress_),
      emcys_(config.routing, config.network_id, node.dictionary(), node.emcy(), post_, events,
             counters) {
  exit_.set_write_rule(rule);
  if (config.canopen_fd) {
    usdo_exit_ = std::make_unique<routing::UsdoEgress>(
        config.routing,
        routing::UsdoEgress::Line{.node = config.node_id,
                                  .sdo_timeout = config.sdo_timeout,
                                  .size_of =
                                      [&config](std::uint8_t id, od::Address address) {
                                        return described_size(config, id, address);
                                      }},
        arbiter, post_, events, counters);
    usdo_exit_->set_write_rule(rule);
  }
  tables_changed();
  node.set_sdo_network_handler(this);
}

Routing::~Routing() = default;

void Routing::tables_changed() {
  LINEGATE_ASSERT(node_.dictionary().set_hook(od::objects::kRoutingTable, &table_).ok(),
                  "the own dictionary has a routing table");
  emcys_.update_gateways();
  post_.set_ways(config_.routing.interfaces);
}

void Routing::deliver(const routing::Message& message, bool usable, Instant now) {
  set_usable(usable);
  receive_message(message, now);
  hand_on(usable, now);
}

void Routing::receive_message(const routing::Message& message, Instant now) {
  switch (message.kind) {
    case routing::MessageKind::sdo_open:
    case routing::MessageKind::sdo_request:
    case routing::MessageKind::sdo_close:
      enter(message, now);
      return;
    case routing::MessageKind::emcy:
      emcys_.deliver(message, now);
      return;
    default:
      ingress_.deliver(message, now);
      return;
  }
}

void Routing::enter(const routing::Message& message, Instant now) {
  if (message.to != config_.routing.interface) {
    gateways_.deliver(message, now);
  } else if (usdo_exit_ != nullptr && usdo_exit_->takes(message)) {
    usdo_exit_->deliver(message, now);
  } else {
    exit_.deliver(message, now);
  }
}

void Routing::set_usable(bool usable) {
  exit_.set_usable(usable);
  if (usdo_exit_ != nullptr) {
    usdo_exit_->set_usable(usable);
  }
}

void Routing::start(routing::RemoteRequest request, bool usable, Instant now) {
  clients_.start(std::move(request), now);
  hand_on(usable, now);
}

void Routing::cancel(const sdo::TransferOwner& owner, std::uint64_t number, bool usable,
                     Instant now) {
  clients_.cancel(owner, number, now);
  hand_on(usable, now);
}

void Routing::hand_on(bool usable, Instant now) {
  set_usable(usable);
  routing::Message message;
  do {
    while (post_.take(message)) {
      receive_message(message, now);
    }
  } while (clients_.pump(now));
}

// First what restarts time-outs.
void Routing::advance(bool usable, Instant now) {
  gateways_.advance(now);
  if (usdo_exit_ != nullptr) {
    usdo_exit_->advance(now);
  }
  hand_on(usable, now);
  ingress_.advance(now);
  exit_.advance(now);
  clients_.advance(now);
  hand_on(usable, now);
}

Instant Routing::next_wake() const {
  const Instant usdo = usdo_exit_ != nullptr ? usdo_exit_->next_wake() : kNever;
  return earlier(usdo, earlier(earlier(clients_.next_wake(), gateways_.next_wake()),
                               earlier(ingress_.next_wake(), exit_.next_wake())));
}

void Routing::answer_gateway_request(routing::GatewayAnswer answer, bool usable, Instant now) {
  gateways_.answer(std::move(answer), now);
  hand_on(usable, now);
}

// First what other gateways and devices of CANopen FD may have carried out: the clients receive
// that, instead of a refusal.
void Routing::stop(Instant now) {
  gateways_.stop(now);
  if (usdo_exit_ != nullptr) {
    usdo_exit_->stop(now);
  }
  hand_on(false, now);
  ingress_.stop(now);
  exit_.stop(now);
  hand_on(false, now);
}

void Routing::routes(std::vector<routing::Route>& out) const {
  routing::append_routes(node_.dictionary(), out);
}

Routing::ServerSide& Routing::side_of(sdo::Server& server) {
  for (const auto& side : sides_) {
    if (side->is(server)) {
      return *side;
    }
  }
  sides_.push_back(std::make_unique<ServerSide>(server, node_.transmit()));
  return *sides_.back();
}

void Routing::network_request(sdo::Server& server, std::uint64_t request, Instant now) {
  server.divert(true);
  ingress_.request(side_of(server), request, now);
}

void Routing::diverted_request(sdo::Server& server, std::uint64_t request, Instant now) {
  ingress_.request(side_of(server), request, now);
}

void Routing::diverted_reset(sdo::Server& server) {
  ingress_.gone(side_of(server));
}

}  // namespace linegate::line
