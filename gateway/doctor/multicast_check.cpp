// SPDX-License-Identifier: Apache-2.0
// Whether this host sends and receives multicast at all, if no gateway of another host is seen.
#include "gateway/doctor/checks.h"
#include "gateway/doctor/facts.h"

namespace linegate::doctor {

void check_multicast(const Observations& seen, Findings& found) {
  const bool is_used = seen.network.servers.empty();
  if (!is_used || (has_gateway(seen) && !has_only_local_gateways(seen)))
    return;
  for (const Interface& it : seen.interfaces) {
    if (!it.multicast_tested || it.multicast_received || it.loopback)
      continue;
    const bool refused = !it.multicast_error.empty();
    found.push_back({.cause = "multicast-blocked",
                     .seen = {refused ? "a datagram to 239.255.0.1 on interface " + safe(it.name) +
                                            " could not be sent: " + it.multicast_error
                                      : "a datagram to 239.255.0.1 on interface " + safe(it.name) +
                                            " was sent, and this host did not receive it itself"},
                     .means = "programs announce themselves by multicast, which this host blocks",
                     .advice = refused ? "check the route to 224.0.0.0/4: ip route get 239.255.0.1"
                                       : "permit UDP to 239.255.0.1 in the firewall of this host"});
  }
}

}  // namespace linegate::doctor
