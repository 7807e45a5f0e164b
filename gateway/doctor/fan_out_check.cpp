// SPDX-License-Identifier: Apache-2.0
// Images by multicast that are asked for, and that a gateway does not send or the network does not
// carry.
#include <algorithm>
#include <set>

#include "gateway/doctor/checks.h"
#include "gateway/doctor/facts.h"

namespace linegate::doctor {
namespace {

constexpr const char* kImages = "linegate/v1/ProcessImage";

void report_unicast(const std::set<std::string>& gateways, Findings& found) {
  for (const std::string& gateway : gateways) {
    found.push_back({.cause = "images-by-unicast",
                     .seen = {gateway + " does not send process images by multicast"},
                     .means = "this program receives its images by unicast, at the full cost for "
                              "the gateway; nothing is missing",
                     .advice = "set dds: {fan_out: multicast} in its plant.yaml, or leave out "
                               "--multicast"});
  }
}

// Everything else comes by unicast: states and layouts show that the gateway is received.
void report_lost(const Observations& seen, const std::set<std::string>& senders, Findings& found) {
  for (const ReceivedGateway& gateway : seen.received) {
    const std::string name = "gateway '" + safe(gateway.name) + "'";
    if (gateway.layouts == 0 || gateway.images != 0 || !senders.contains(name))
      continue;
    found.push_back({.cause = "images-by-multicast-lost",
                     .seen = {"states and layouts of " + name + " arrive, and none of its images",
                              "it sends images to 239.255.76.71, UDP port " +
                                  std::to_string(7401 + 250 * seen.domain)},
                     .means = "the network or a firewall does not carry that group to this host",
                     .advice = "permit that port in the firewall of this host, check IGMP snooping "
                               "of the switches, or leave out --multicast"});
  }
}

}  // namespace

void check_fan_out(const Observations& seen, Findings& found) {
  if (!seen.multicast)
    return;
  const std::vector<bool> of_gateway = of_gateways(seen);
  std::set<std::string> senders;
  std::set<std::string> others;
  for (std::size_t i = 0; i < seen.endpoints.size(); ++i) {
    const dds::ObservedEndpoint& it = seen.endpoints[i];
    if (it.writer && of_gateway[i] && it.topic == kImages)
      (it.multicast ? senders : others).insert(owner_text(seen, it));
  }
  report_unicast(others, found);
  report_lost(seen, senders, found);
}

}  // namespace linegate::doctor
