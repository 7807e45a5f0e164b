// SPDX-License-Identifier: Apache-2.0
// The interfaces of this host, if no gateway is seen.
#include "gateway/doctor/checks.h"
#include "gateway/doctor/facts.h"

namespace linegate::doctor {
namespace {

void report_down(const Interface& it, Findings& found) {
  found.push_back(
      {.cause = "interface-down",
       .seen = {"interface " + safe(it.name) + " with address " + it.addresses.front() +
                (it.up ? " has no carrier" : " is down")},
       .means = "nothing is sent or received on it: the cause, if the gateway is in that network",
       .advice = it.up ? "connect the cable, and check the switch"
                       : "ip link set " + safe(it.name) + " up"});
}

void report_no_multicast(const Interface& it, Findings& found) {
  found.push_back({.cause = "multicast-off",
                   .seen = {"interface " + safe(it.name) + " with address " + it.addresses.front() +
                            " has no MULTICAST flag"},
                   .means = "programs announce themselves by multicast; a network card without the "
                            "flag takes no part in it, so switches may deliver nothing",
                   .advice = "ip link set " + safe(it.name) +
                             " multicast on; or use --peer with the address of the other host"});
}

}  // namespace

void check_interfaces(const Observations& seen, Findings& found) {
  if (has_gateway(seen))
    return;
  bool outside = false;  // an interface to other hosts that is up
  const Interface* loopback = nullptr;
  for (const Interface& it : seen.interfaces) {
    if (it.loopback) {
      loopback = it.up ? &it : loopback;
      continue;
    }
    if (it.addresses.empty())
      continue;
    if (!it.up || !it.running) {
      report_down(it, found);
      continue;
    }
    outside = true;
    if (!it.multicast && seen.network.servers.empty())
      report_no_multicast(it, found);
  }
  if (outside)
    return;
  found.push_back({.cause = "no-interface",
                   .seen = {loopback == nullptr ? "no interface of this host is up"
                                                : "loopback is the only interface that is up and "
                                                  "has an IPv4 address"},
                   .means = "this host reaches no other host",
                   .advice = "bring an interface up, and give it an address"});
  if (seen.network.servers.empty() && loopback != nullptr && !loopback->multicast &&
      !loopback->addresses.empty())
    report_no_multicast(*loopback, found);
}

}  // namespace linegate::doctor
