// SPDX-License-Identifier: Apache-2.0
// The own identity, and other reasons why there is no own participant.
#include "gateway/doctor/checks.h"

namespace linegate::doctor {

void check_identity(const Observations& seen, Findings& found) {
  Finding identity{.cause = "identity",
                   .seen = {},
                   .means = "no participant with DDS-Security accepts this identity",
                   .advice =
                       "correct what is named; a certificate that is expired, revoked or of "
                       "another authority is replaced by linegate security issue, and its folder "
                       "copied to this host"};
  for (const Diagnostic& diagnostic : seen.identity_findings)
    identity.seen.push_back(to_string(diagnostic));
  if (!identity.seen.empty())
    found.push_back(std::move(identity));
  if (seen.participant_findings.empty() || has_errors(seen.profile_findings) ||
      has_errors(seen.identity_findings))
    return;
  Finding participant{.cause = "no-participant",
                      .seen = {},
                      .means = "no program of this host with these settings can use DDS",
                      .advice = "correct what is named; see the interfaces and the profile above"};
  for (const Diagnostic& diagnostic : seen.participant_findings)
    participant.seen.push_back(to_string(diagnostic));
  found.push_back(std::move(participant));
}

}  // namespace linegate::doctor
