// SPDX-License-Identifier: Apache-2.0
#include "gateway/publish/routing_text.h"

#include <algorithm>
#include <string_view>

namespace linegate::gateway {
namespace {

constexpr std::size_t kRouteProperties = 6;  // number
constexpr std::size_t kPropertyValue = 256;  // bytes

}  // namespace

std::string networks_text(std::uint16_t first, std::uint16_t last) {
  const std::string text = std::to_string(first);
  return first == last ? text : text + ".." + std::to_string(last);
}

std::string route_text(const routing::Route& route, const InterfaceNames& names) {
  const auto named = std::find_if(names.begin(), names.end(),
                                  [&](const auto& line) { return line.first == route.interface; });
  std::string out = networks_text(route.first, route.last) + ' ' +
                    (named == names.end() ? std::to_string(route.interface) : named->second);
  if (route.gateway != 0) {
    out += ':' + std::to_string(route.gateway);
  }
  return out + ' ' + std::to_string(route.cost);
}

std::string services_text(const routing::AccessRule& rule) {
  std::string out;
  const auto add = [&](bool allowed, std::string_view service) {
    if (allowed) {
      out += (out.empty() ? "" : ", ") + std::string(service);
    }
  };
  add(rule.sdo_read && !rule.sdo_write, "SDO read");
  add(rule.sdo_write, "SDO");
  add(rule.emcy, "EMCY");
  add(rule.pdo, "PDO");
  return out;
}

std::vector<Property> route_properties(std::span<const routing::Route> routes,
                                       const InterfaceNames& names) {
  std::vector<Property> out;
  std::size_t left_out = 0;
  for (const routing::Route& route : routes) {
    const std::string text = route_text(route, names);
    if (!out.empty() && out.back().value.size() + 2 + text.size() <= kPropertyValue) {
      out.back().value += ", " + text;
    } else if (out.size() < kRouteProperties) {
      out.push_back({"routes-" + std::to_string(out.size() + 1), text});
    } else {
      ++left_out;
    }
  }
  if (left_out > 0) {
    out.push_back({"routes-left-out", std::to_string(left_out)});
  }
  return out;
}

void add_forwarding(const routing::Counters& counters, std::vector<Property>& out) {
  if (counters.values != 0) {
    out.push_back({"routing-values", std::to_string(counters.values)});
  }
}

void add_sleep(const line::LineState& state, std::vector<Property>& out) {
  if (state.sleep) {
    out.push_back({"sleep", std::string(nmt::name(*state.sleep))});
  }
}

void add_srdos(const line::SrdoCounters& counters, std::vector<Property>& out) {
  if (counters.received != 0) {
    out.push_back({"srdos", std::to_string(counters.received)});
    out.push_back({"srdos-valid", std::to_string(counters.valid)});
    out.push_back({"srdo-pairs", std::to_string(counters.pairs)});
    out.push_back({"srdo-faults", std::to_string(counters.faults)});
  }
}

void add_properties(const routing::Counters& counters, std::uint64_t stalls,
                    std::vector<Property>& out) {
  const auto add = [&](const char* name, std::uint64_t value) {
    out.push_back({name, std::to_string(value)});
  };
  add("routing-open", counters.open);
  add("routing-opened", counters.opened);
  add("routing-finished", counters.finished);
  add("routing-aborted", counters.aborted);
  add("routing-timed-out", counters.timed_out);
  add("routing-refused", counters.refused);
  add("routing-not-permitted", counters.not_permitted);
  add("routing-channels", counters.channels);
  add("routing-forwarded", counters.forwarded);
  add("routing-lost", counters.lost);
  add("routing-emcys", counters.emcy_forwarded);
  add("routing-emcys-dropped", counters.emcy_dropped);
  add("routing-unexpected", counters.unexpected);
  add("routing-stalls", stalls);
}

}  // namespace linegate::gateway
