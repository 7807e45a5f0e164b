// SPDX-License-Identifier: Apache-2.0
// Discovery servers, if no gateway is received.
#include <algorithm>

#include "gateway/doctor/checks.h"
#include "gateway/doctor/facts.h"

namespace linegate::doctor {
namespace {

std::string server_text(const dds::ObservedServer& server) {
  return "the discovery server on " + server.place.address + ", UDP port " +
         std::to_string(server.place.port) + ", with ID " + std::to_string(server.id);
}

bool is_discovered(const Observations& seen, const dds::ObservedServer& server) {
  return std::ranges::any_of(seen.participants, [&](const dds::ObservedParticipant& it) {
    return it.prefix == server.prefix;
  });
}

void report_server(const Observations& seen, const dds::ObservedServer& server, Findings& found) {
  if (!is_discovered(seen, server)) {
    found.push_back(
        {.cause = "server-silent",
         .seen = {server_text(server) + " was not discovered within " + seconds_text(seen.watched)},
         .means = "no server runs there, it has another ID, or a firewall drops UDP to or from it",
         .advice = "start it there with fastdds discovery -i " + std::to_string(server.id) +
                   " -l " + server.place.address + " -p " + std::to_string(server.place.port) +
                   "; permit UDP to that port, and back"});
  } else if (!has_gateway(seen)) {
    found.push_back(
        {.cause = "server-without-gateway",
         .seen = {server_text(server) + " is discovered, and it announced no gateway"},
         .means = "no gateway of DDS domain " + std::to_string(seen.domain) + " uses this server",
         .advice = "set dds: {discovery_servers: [...]} in the plant.yaml of the gateway to the "
                   "same servers in the same order, and check its DDS domain"});
  }
}

}  // namespace

void check_servers(const Observations& seen, Findings& found) {
  if (seen.network.servers.empty() || !seen.received.empty())
    return;
  for (const dds::ObservedServer& server : seen.network.servers)
    report_server(seen, server, found);
  for (const Heard* const gateway : gateways_in_domain(seen)) {
    found.push_back(
        {.cause = "not-at-server",
         .seen = {heard_text(*gateway) + " announces itself by multicast"},
         .means = "a program with discovery servers discovers those alone that use them",
         .advice = "do without discovery servers here, or set dds: {discovery_servers: "
                   "[...]} in the plant.yaml of that gateway"});
  }
}

}  // namespace linegate::doctor
