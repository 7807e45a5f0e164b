// SPDX-License-Identifier: Apache-2.0
#include "stack/routing/emcy_router.h"

#include <algorithm>

#include "stack/od/objects.h"
#include "stack/routing/table.h"

namespace linegate::routing {
namespace {

constexpr unsigned kNetworks = 32;  // number of networks in an element of 1F2Fh

// The EMCY as data of a message between lines.
std::array<std::byte, 8> bytes_of(const ForwardedEmcy& emcy) {
  const emcy::Message message = encode(emcy);
  std::array<std::byte, 8> out;
  store_le(out.data(), message.code);
  out[2] = std::byte{message.error_register};
  std::ranges::copy(message.info, out.begin() + 3);
  return out;
}

std::optional<ForwardedEmcy> emcy_of(const Message& message) {
  emcy::Message out{.code = load_le<std::uint16_t>(message.data.data()),
                    .error_register = std::to_integer<std::uint8_t>(message.data[2])};
  std::copy_n(message.data.begin() + 3, out.info.size(), out.info.begin());
  return decode(out);
}

}  // namespace

EmcyRouter::EmcyRouter(const Config& config, std::uint16_t network,
                       const od::Dictionary& dictionary, emcy::Producer& producer, Post& post,
                       EventLog& events, Counters& counters)
    : config_(config),
      network_(network),
      dictionary_(dictionary),
      producer_(producer),
      post_(post),
      events_(events),
      counters_(counters) {
  update_gateways();
}

void EmcyRouter::update_gateways() {
  gateways_.reset();
  for (const std::uint8_t node : config_.gateways) {
    gateways_.set(node & can::kMaxNodeId);
  }
  for (const Route& route : config_.routes) {
    if (route.interface == config_.interface) {
      gateways_.set(route.gateway & can::kMaxNodeId);
    }
  }
  gateways_.reset(0);
}

void EmcyRouter::heard(std::uint8_t node, const emcy::Message& message, Instant now) {
  ForwardedEmcy emcy{.code = message.code,
                     .error_register = message.error_register,
                     .network = network_,
                     .node = node};
  if (const auto forwarded = is_gateway(node) ? decode(message) : std::nullopt) {
    emcy = *forwarded;
    if (!is_new(emcy, now)) {
      ++counters_.emcy_dropped;
      return;
    }
    report(emcy, node, now);
    if (emcy.network == network_ || emcy.hops >= config_.hop_limit) {
      ++counters_.emcy_dropped;
      return;
    }
    ++emcy.hops;
  } else {
    emcy.number = number_++;
    (void)is_new(emcy, now);
  }
  forward(
      emcy,
      static_cast<std::uint32_t>(dictionary_.number({od::objects::kEmcyRouting, node}).value_or(0)),
      now);
}

// One message serves all networks that are reached over the same line.
void EmcyRouter::forward(const ForwardedEmcy& emcy, std::uint32_t networks, Instant now) {
  std::bitset<256> interfaces;
  const Table table = networks != 0 ? read_table(dictionary_) : Table{};
  for (unsigned network = 1; network <= kNetworks; ++network) {
    if ((networks >> (network - 1) & 1U) == 0 || network == emcy.network || network == network_) {
      continue;
    }
    const Route* const route = table.find(static_cast<std::uint16_t>(network), config_.interface);
    if (route == nullptr || find_way(config_.interfaces, route->interface) != nullptr) {
      ++counters_.emcy_dropped;
      report_refused(events_, RoutedService::emcy, emcy.network,
                     {.network = static_cast<std::uint16_t>(network), .node = 0},
                     AbortCode::invalid_value, now);
      continue;
    }
    if (interfaces.test(route->interface)) {
      continue;
    }
    interfaces.set(route->interface);
    const bool sent = post_.send({.to = route->interface,
                                  .kind = MessageKind::emcy,
                                  .hops = emcy.hops,
                                  .network = static_cast<std::uint16_t>(network),
                                  .source = network_,
                                  .node = emcy.node,
                                  .gateway = route->gateway,
                                  .data = bytes_of(emcy)});
    ++(sent ? counters_.emcy_forwarded : counters_.emcy_dropped);
  }
}

void EmcyRouter::deliver(const Message& message, Instant now) {
  const auto emcy = emcy_of(message);
  if (!emcy) {
    ++counters_.unexpected;
    return;
  }
  if (!may_enter(message.source)) {
    ++counters_.not_permitted;
    report_refused(events_, RoutedService::emcy, message.source,
                   {.network = message.network, .node = 0}, AbortCode::local_control, now);
    return;
  }
  if (emcy->network == network_ || !is_new(*emcy, now)) {
    ++counters_.emcy_dropped;
    return;
  }
  report(*emcy, 0, now);
  const auto result = producer_.relay(encode(*emcy), now);
  if (result == emcy::SendResult::inhibited || result == emcy::SendResult::disabled) {
    ++counters_.emcy_dropped;
  }
}

bool EmcyRouter::is_new(const ForwardedEmcy& emcy, Instant now) {
  const auto same = [&](const Seen& seen) {
    return seen.emcy.same(emcy) && now < seen.time + kRememberedFor;
  };
  if (std::ranges::any_of(seen_, same)) {
    return false;
  }
  seen_[next_seen_] = {emcy, now};
  next_seen_ = (next_seen_ + 1) % seen_.size();
  return true;
}

bool EmcyRouter::may_enter(std::uint16_t network) const {
  return std::ranges::any_of(config_.access, [&](const AccessRule& rule) {
    return network >= rule.first && network <= rule.last && rule.emcy;
  });
}

void EmcyRouter::report(const ForwardedEmcy& emcy, std::uint8_t from, Instant now) {
  events_.emit({.time = now,
                .node = from,
                .data = event::EmcyRouted{.code = emcy.code,
                                          .source = emcy.network,
                                          .source_node = emcy.node,
                                          .error_register = emcy.error_register,
                                          .hops = emcy.hops,
                                          .number = emcy.number}});
}

}  // namespace linegate::routing
