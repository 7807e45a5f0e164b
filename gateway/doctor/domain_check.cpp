// SPDX-License-Identifier: Apache-2.0
// A gateway in another DDS domain.
#include <set>

#include "gateway/doctor/checks.h"
#include "gateway/doctor/facts.h"

namespace linegate::doctor {

void check_domain(const Observations& seen, Findings& found) {
  if (has_gateway(seen))
    return;
  Finding out{.cause = "other-domain",
              .seen = {"no gateway in DDS domain " + std::to_string(seen.domain)},
              .means = "programs see only those of their own domain",
              .advice = {}};
  std::set<std::uint32_t> domains;
  for (const Heard& heard : seen.heard) {
    if (heard.domain == seen.domain || heard.left || gateway_name(heard.announcement.name).empty())
      continue;
    out.seen.push_back(heard_text(heard) + " in domain " + std::to_string(heard.domain));
    domains.insert(heard.domain);
  }
  if (domains.empty())
    return;
  for (const std::uint32_t domain : domains)
    out.advice += (out.advice.empty() ? "use --domain " : " or ") + std::to_string(domain);
  out.advice += "; or set dds: {domain: " + std::to_string(seen.domain) +
                "} in the plant.yaml of the gateway";
  found.push_back(std::move(out));
}

}  // namespace linegate::doctor
