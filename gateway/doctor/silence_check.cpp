// SPDX-License-Identifier: Apache-2.0
// Nothing is received, and no other check has found the cause.
#include <algorithm>

#include "gateway/doctor/checks.h"
#include "gateway/doctor/facts.h"

namespace linegate::doctor {
namespace {

std::string local_text(const Observations& seen) {
  std::string out;
  for (const LocalParticipant& it : seen.local)
    out += (out.empty() ? "" : ", ") + std::to_string(it.domain);
  return out.empty() ? "no DDS program on this host has its ports open"
                     : "DDS programs on this host have ports of the domains open: " + out;
}

}  // namespace

void check_silence(const Observations& seen, Findings& found) {
  // An interface without carrier may have nothing to do with it, as that of a bridge.
  const bool is_explained =
      std::ranges::any_of(found, [](const Finding& it) { return it.cause != "interface-down"; });
  if (is_explained || !seen.received.empty())
    return;
  if (has_gateway(seen)) {
    Finding out{.cause = "no-samples",
                .seen = {},
                .means =
                    "discovery works, and data do not arrive: the ports for data may be "
                    "blocked (the one above each port for discovery)",
                .advice =
                    "permit UDP to the ports 7400 to 7649 + 250 x domain in both directions; "
                    "run linegate doctor on the host of the gateway"};
    for (const Heard* const gateway : gateways_in_domain(seen))
      out.seen.push_back(heard_text(*gateway) + " is discovered, and no state of it was received");
    if (out.seen.empty())
      out.seen.emplace_back("a gateway is discovered, and no state of it was received");
    found.push_back(std::move(out));
    return;
  }
  found.push_back(
      {.cause = "nothing-heard",
       .seen = {"no gateway announced itself in any of the domains 0 to 232 within " +
                    seconds_text(seen.watched),
                local_text(seen)},
       .means = "no gateway runs, or the network between the hosts does not carry multicast, or "
                "the gateway uses discovery servers; this program cannot distinguish these from "
                "here",
       .advice = "run linegate doctor on the host of the gateway; if it finds the gateway there, "
                 "run linegate doctor HOST here, with the address of that host"});
}

}  // namespace linegate::doctor
