// SPDX-License-Identifier: Apache-2.0
// Hosts that were given as an argument, and do not answer as a gateway; if no gateway is seen, also
// those that are initial peers of the profile.
#include <algorithm>

#include "gateway/doctor/checks.h"
#include "gateway/doctor/facts.h"

namespace linegate::doctor {
namespace {

std::string host_text(const ProbedHost& host) {
  return host.name == host.address ? safe(host.name) : safe(host.name) + " (" + host.address + ")";
}

std::string ports_text(const ProbedHost& host) {
  if (host.ports.empty())
    return "no port";
  return std::to_string(host.ports.front().port) + " to " + std::to_string(host.ports.back().port);
}

bool is_gateway(const ProbedPort& port) {
  return port.answer == PortAnswer::answered && !gateway_name(port.program).empty();
}

// A gateway of that host is known to be reachable.
bool is_heard(const Observations& seen, const ProbedHost& host) {
  return std::ranges::any_of(host.ports, is_gateway) ||
         std::ranges::any_of(gateways_in_domain(seen), [&](const Heard* gateway) {
           return !host.address.empty() && gateway->from == host.address;
         });
}

void report_answering(const ProbedHost& host, Findings& found) {
  const auto gateway = std::ranges::find_if(host.ports, is_gateway);
  if (gateway == host.ports.end()) {
    const auto other = std::ranges::find(host.ports, PortAnswer::answered, &ProbedPort::answer);
    found.push_back(
        {.cause = "peer-without-gateway",
         .seen = {"program '" + safe(other->program) + "' on " + host_text(host) +
                  " answers on UDP port " + std::to_string(other->port) + ", and no gateway does"},
         .means = "no gateway of this domain runs there, or not among the first four "
                  "DDS programs of that host",
         .advice = "run linegate doctor on that host"});
    return;
  }
  found.push_back({.cause = "multicast-lost",
                   .seen = {"gateway '" + safe(gateway_name(gateway->program)) + "' on " +
                                host_text(host) + " answers by unicast",
                            "no multicast announcement of a gateway arrived from any host"},
                   .means = "the network between the hosts does not carry multicast, as routers "
                            "and some wireless networks",
                   .advice = "use --peer " + host.address +
                             " for programs on this host, or list this host in dds: {peers: "
                             "[...]} of the gateway"});
}

void report_peer(const Observations& seen, const ProbedHost& host, Findings& found) {
  const auto any = [&](PortAnswer answer) {
    return std::ranges::any_of(host.ports,
                               [&](const ProbedPort& it) { return it.answer == answer; });
  };
  if (host.address.empty()) {
    found.push_back({.cause = "peer-unknown",
                     .seen = {"the name " + safe(host.name) + " has no IPv4 address"},
                     .means = "nothing is sent to this host",
                     .advice = "correct the name, or give the address"});
  } else if (any(PortAnswer::unreachable)) {
    const auto port = std::ranges::find(host.ports, PortAnswer::unreachable, &ProbedPort::answer);
    found.push_back({.cause = "peer-unreachable",
                     .seen = {"UDP to " + host_text(host) + ": " + port->error},
                     .means = "no datagram of this host arrives there",
                     .advice = "check the address, the route (ip route get " + host.address +
                               ") and whether that host is on"});
  } else if (any(PortAnswer::answered)) {
    report_answering(host, found);
  } else if (any(PortAnswer::refused)) {
    found.push_back(
        {.cause = "peer-without-dds",
         .seen = {host_text(host) + " is reached, and no program answers on the UDP ports " +
                  ports_text(host) + " of domain " + std::to_string(seen.domain)},
         .means = "no gateway of this domain runs there, or not among the first four DDS programs "
                  "of that host",
         .advice = "run linegate doctor on that host: is linegated running, and in which domain?"});
  } else {
    found.push_back(
        {.cause = "peer-silent",
         .seen = {host_text(host) + " sends no answer and no refusal on the UDP ports " +
                  ports_text(host)},
         .means = "the address is wrong, the host is off, or a firewall drops UDP; a "
                  "host that is on would refuse unused ports",
         .advice = "check the address; permit UDP to and from these ports in the "
                   "firewalls of both hosts and between them"});
  }
}

}  // namespace

void check_peers(const Observations& seen, Findings& found) {
  const bool has_any = has_gateway(seen);
  for (const ProbedHost& host : seen.probes) {
    if (has_any ? host.named && !is_heard(seen, host) : host.given)
      report_peer(seen, host, found);
  }
}

}  // namespace linegate::doctor
