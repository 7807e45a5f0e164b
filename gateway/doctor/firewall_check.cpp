// SPDX-License-Identifier: Apache-2.0
// Gateways whose announcements arrive, but nothing else.
#include <algorithm>

#include "gateway/doctor/checks.h"
#include "gateway/doctor/facts.h"

namespace linegate::doctor {
namespace {

struct Answers {
  std::string silent;  // "10.0.0.1:7410, 10.0.0.1:7412"
  std::string refused;
  std::string unreachable;  // with the error of the system
  bool answered = false;
  bool arrives = false;  // a closed port of that host was refused
};

Answers answers_of(const Observations& seen, const Heard& gateway) {
  Answers out;
  for (const dds::UdpLocator& locator : gateway.announcement.unicast) {
    for (const ProbedHost& host : seen.probes) {
      const auto port = std::ranges::find(host.ports, locator.port, &ProbedPort::port);
      if (host.address != locator.address || port == host.ports.end())
        continue;
      const std::string place = locator.address + ":" + std::to_string(locator.port);
      out.arrives = out.arrives || host.closed.answer == PortAnswer::refused;
      out.answered = out.answered || port->answer == PortAnswer::answered;
      if (port->answer == PortAnswer::silent)
        out.silent += (out.silent.empty() ? "" : ", ") + place;
      if (port->answer == PortAnswer::refused)
        out.refused += (out.refused.empty() ? "" : ", ") + place;
      if (port->answer == PortAnswer::unreachable)
        out.unreachable += (out.unreachable.empty() ? "" : ", ") + place + " " + port->error;
    }
  }
  return out;
}

void report_silent(const Heard& gateway, const Answers& answers, Findings& found) {
  const std::string heard = heard_text(gateway) + " is heard by multicast";
  if (answers.arrives) {
    found.push_back(
        {.cause = "not-answered",
         .seen = {heard, "its UDP ports " + answers.silent +
                             " do not answer; an unused port of the same host is refused, so "
                             "datagrams do arrive there"},
         .means = "the gateway ignores this program, or its answers are dropped on the way back",
         .advice =
             "on the host of the gateway: linegate gateways (is the number of DDS participants "
             "at its limit, dds: {participants: N}?) and the log of linegated; permit UDP to "
             "this host in its firewall"});
    return;
  }
  found.push_back({.cause = "firewall",
                   .seen = {heard, "its UDP ports " + answers.silent +
                                       " give no answer and no refusal, nor does an unused port of "
                                       "the same host"},
                   .means = "a firewall drops UDP by unicast between the two hosts",
                   .advice = "permit UDP to and from these ports, and the next higher one of each "
                             "(data), in the firewalls of both hosts and between them"});
}

}  // namespace

void check_firewall(const Observations& seen, Findings& found) {
  if (!seen.network.servers.empty())
    return;  // nothing is discovered by multicast then: check_servers()
  for (const Heard* const gateway : gateways_in_domain(seen)) {
    const dds::Announcement& it = gateway->announcement;
    if (it.secured != seen.secured() || is_received(seen, gateway_name(it.name)) ||
        has_endpoints(seen, it.prefix))
      continue;
    const Answers answers = answers_of(seen, *gateway);
    if (answers.answered)
      continue;
    // A gateway announces each of its addresses, some of which others may not reach.
    if (!answers.silent.empty()) {
      report_silent(*gateway, answers, found);
    } else if (!answers.refused.empty()) {
      found.push_back({.cause = "refused",
                       .seen = {heard_text(*gateway) + " is heard by multicast",
                                "its UDP ports " + answers.refused + " are refused"},
                       .means = "a firewall rejects UDP by unicast, or the gateway has just ended",
                       .advice = "permit UDP to these ports, and the next higher one of each "
                                 "(data), in the firewalls of both hosts and between them"});
    } else if (!answers.unreachable.empty()) {
      found.push_back({.cause = "no-route",
                       .seen = {heard_text(*gateway) + " is heard by multicast",
                                "its addresses cannot be reached: " + answers.unreachable},
                       .means = "this host cannot answer the gateway: there is no route, or a "
                                "firewall that rejects says so",
                       .advice = "give both hosts addresses of one network, or add a route; if "
                                 "there is one, permit UDP in the firewalls"});
    }
  }
}

}  // namespace linegate::doctor
