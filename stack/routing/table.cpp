// SPDX-License-Identifier: Apache-2.0
#include "stack/routing/table.h"

#include <algorithm>

#include "stack/can/cob_id.h"

namespace linegate::routing {
namespace {

bool overlap(const Route& a, const Route& b) {
  return a.used() && b.used() && a.cost == b.cost && a.first <= b.last && b.first <= a.last;
}

// Over another gateway to the network of a line of this process: when that line cannot send, the
// request would reach a device of another network with that number.
bool leads_back(const Route& route, std::span<const Interface> interfaces) {
  return std::any_of(interfaces.begin(), interfaces.end(), [&](const Interface& i) {
    return i.way == nullptr && route.reaches(i.network);
  });
}

}  // namespace

std::shared_ptr<const GatewayWay> find_way(std::span<const Interface> interfaces,
                                           std::uint8_t number) {
  const auto found = std::find_if(interfaces.begin(), interfaces.end(),
                                  [&](const Interface& i) { return i.number == number; });
  return found == interfaces.end() ? nullptr : found->way;
}

std::uint64_t encode(const Route& route) {
  return std::uint64_t{route.first} | std::uint64_t{route.last} << 16U |
         std::uint64_t{route.interface} << 32U | std::uint64_t{route.gateway} << 40U |
         std::uint64_t{route.cost} << 48U;
}

Route decode(std::uint64_t entry) {
  return {.first = static_cast<std::uint16_t>(entry),
          .last = static_cast<std::uint16_t>(entry >> 16U),
          .interface = static_cast<std::uint8_t>(entry >> 32U),
          .gateway = static_cast<std::uint8_t>(entry >> 40U),
          .cost = static_cast<std::uint16_t>(entry >> 48U)};
}

std::string_view describe(RouteFault fault) {
  switch (fault) {
    case RouteFault::none:
      return "in order";
    case RouteFault::bad_range:
      return "network 0, or the last network is below the first";
    case RouteFault::unknown_interface:
      return "no line has this interface number";
    case RouteFault::bad_gateway:
      return "the next gateway is not a node-ID in 0..127; over another gateway it is 0";
    case RouteFault::not_attached:
      return "not the network of the interface, and no gateway to it is named";
    case RouteFault::loop:
      return "a loop: the way leads back over the own node or the network itself";
    case RouteFault::overlap:
      return "another route of equal cost leads to the same network";
  }
  return "unknown";
}

AbortCode abort_of(RouteFault fault) {
  switch (fault) {
    case RouteFault::none:
      return AbortCode::none;
    case RouteFault::overlap:
      return AbortCode::parameter_incompatible;
    default:
      return AbortCode::invalid_value;
  }
}

RouteFault check(const Route& route, std::span<const Interface> interfaces) {
  if (!route.used()) {
    return RouteFault::none;
  }
  if (route.first == 0 || route.last < route.first) {
    return RouteFault::bad_range;
  }
  const auto line = std::find_if(interfaces.begin(), interfaces.end(),
                                 [&](const Interface& i) { return i.number == route.interface; });
  if (line == interfaces.end()) {
    return RouteFault::unknown_interface;
  }
  if (route.gateway > can::kMaxNodeId || (line->way != nullptr && route.gateway != 0)) {
    return RouteFault::bad_gateway;
  }
  if (line->way != nullptr) {
    return leads_back(route, interfaces) ? RouteFault::loop : RouteFault::none;
  }
  const bool only_it = route.first == line->network && route.last == line->network;
  if (route.gateway == 0) {
    return only_it ? RouteFault::none : RouteFault::not_attached;
  }
  return only_it || route.gateway == line->node ? RouteFault::loop : RouteFault::none;
}

std::vector<RouteFinding> check(std::span<const Route> routes,
                                std::span<const Interface> interfaces) {
  std::vector<RouteFinding> out;
  for (std::size_t entry = 0; entry < routes.size(); ++entry) {
    if (const RouteFault fault = check(routes[entry], interfaces); fault != RouteFault::none) {
      out.push_back({.fault = fault, .entry = entry});
      continue;
    }
    for (std::size_t other = 0; other < entry; ++other) {
      if (overlap(routes[entry], routes[other])) {
        out.push_back({.fault = RouteFault::overlap, .entry = entry, .other = other});
        break;
      }
    }
  }
  return out;
}

Table::Table(std::span<const Route> routes) {
  for (const Route& route : routes) {
    if (route.used()) {
      routes_.push_back(route);
    }
  }
  std::stable_sort(routes_.begin(), routes_.end(),
                   [](const Route& a, const Route& b) { return a.cost < b.cost; });
}

const Route* Table::find(std::uint16_t network, std::uint8_t not_over, std::size_t skip) const {
  for (const Route& route : routes_) {
    if (route.reaches(network) && route.interface != not_over && skip-- == 0) {
      return &route;
    }
  }
  return nullptr;
}

}  // namespace linegate::routing
