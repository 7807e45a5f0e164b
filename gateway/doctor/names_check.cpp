// SPDX-License-Identifier: Apache-2.0
// Two gateways of one name.
#include <map>

#include "gateway/doctor/checks.h"
#include "gateway/doctor/facts.h"

namespace linegate::doctor {

void check_names(const Observations& seen, Findings& found) {
  // Both were alive together: the one was heard for longer than the restart of a gateway takes, and
  // neither is silent now. A gateway announces itself once a second.
  constexpr Duration kTogether = std::chrono::seconds(2);
  std::map<std::string, std::vector<const Heard*>> by_name;
  for (const Heard* const gateway : gateways_in_domain(seen)) {
    if (gateway->last - gateway->first >= kTogether && seen.watched - gateway->last <= kTogether)
      by_name[gateway_name(gateway->announcement.name)].push_back(gateway);
  }
  for (const auto& [name, gateways] : by_name) {
    if (gateways.size() < 2)
      continue;
    Finding out{.cause = "same-name",
                .seen = {},
                .means =
                    "values of both are mixed, and each receives the requests to the other; "
                    "clients send no command to them",
                .advice =
                    "give one of them another name (gateway: {name: ...} in its plant.yaml) "
                    "or another domain"};
    for (const Heard* const gateway : gateways) {
      const std::string& host = gateway->announcement.host;
      out.seen.push_back(heard_text(*gateway) + (host.empty() ? "" : " on host " + safe(host)));
    }
    found.push_back(std::move(out));
  }
}

}  // namespace linegate::doctor
