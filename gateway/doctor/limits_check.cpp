// SPDX-License-Identifier: Apache-2.0
// A gateway that accepts no further participant.
#include "gateway/doctor/checks.h"
#include "gateway/doctor/facts.h"

namespace linegate::doctor {

void check_limits(const Observations& seen, Findings& found) {
  for (const ReceivedGateway& gateway : seen.received) {
    if (gateway.participants_most == 0 || gateway.participants < gateway.participants_most)
      continue;
    found.push_back({.cause = "participants-limit",
                     .seen = {"gateway '" + safe(gateway.name) + "' has " +
                              std::to_string(gateway.participants) + " other participants of " +
                              std::to_string(gateway.participants_most) +
                              " at most, those of this program among them"},
                     .means = "no place is left but those that this program uses now: the "
                              "gateway ignores programs above the limit",
                     .advice = "raise dds: {participants: N} in its plant.yaml, or end programs "
                               "that are not needed"});
  }
}

}  // namespace linegate::doctor
