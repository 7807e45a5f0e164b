// SPDX-License-Identifier: Apache-2.0
// DDS-Security on one side only, and identities that are refused.
#include <algorithm>

#include "gateway/doctor/checks.h"
#include "gateway/doctor/facts.h"

namespace linegate::doctor {
namespace {

void report_one_side(const Observations& seen, const Heard& gateway, Findings& found) {
  const bool there = gateway.announcement.secured;
  found.push_back(
      {.cause = there ? "gateway-secured" : "gateway-not-secured",
       .seen = {heard_text(gateway) + (there ? " announces an identity" : " announces no identity"),
                there ? "this program was started without --security"
                      : "this program has the identity " + safe(seen.identity)},
       .means = "a participant with DDS-Security and one without do not see each other",
       .advice = there ? "use --security FOLDER with an identity of the same authority"
                       : "leave --security and LINEGATE_SECURITY out, or set dds: {security: "
                         "FOLDER} in the plant.yaml of the gateway"});
}

}  // namespace

void check_security(const Observations& seen, Findings& found) {
  if (has_errors(seen.identity_findings))
    return;
  for (const Heard* const gateway : gateways_in_domain(seen)) {
    const dds::Announcement& it = gateway->announcement;
    if (is_received(seen, gateway_name(it.name)) || has_endpoints(seen, it.prefix))
      continue;
    if (it.secured != seen.secured()) {
      report_one_side(seen, *gateway, found);
      continue;
    }
    const auto known =
        std::ranges::find(seen.participants, it.prefix, &dds::ObservedParticipant::prefix);
    if (!it.secured || known == seen.participants.end() || !known->refused)
      continue;
    Finding out{.cause = "not-authenticated",
                .seen = {"the authentication with " + heard_text(*gateway) + " failed"},
                .means =
                    "one side does not accept the certificate of the other: another "
                    "authority, expired, revoked, or a wrong clock",
                .advice =
                    "compare ca.crt of both identities with sha256sum; run linegate security "
                    "check on both; check the clocks"};
    if (!seen.own_authority.empty() && !it.authority.empty())
      out.seen.push_back("authority of this program: " + safe(seen.own_authority) +
                         "; of the gateway: " + safe(it.authority));
    found.push_back(std::move(out));
  }
}

}  // namespace linegate::doctor
