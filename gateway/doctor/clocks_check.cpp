// SPDX-License-Identifier: Apache-2.0
// Clocks of a gateway and of this host that differ.
#include "gateway/doctor/checks.h"
#include "gateway/doctor/facts.h"

namespace linegate::doctor {

void check_clocks(const Observations& seen, Findings& found) {
  // A state is published once a second and may be delayed; the first sample may be an old one.
  constexpr Duration kTolerated = std::chrono::seconds(2);
  constexpr std::uint32_t kNeeded = 2;
  for (const ReceivedGateway& gateway : seen.received) {
    const Duration difference = gateway.clock_difference;
    if (gateway.samples < kNeeded || (difference <= kTolerated && difference >= -kTolerated))
      continue;
    const bool ahead = difference > Duration::zero();
    found.push_back(
        {.cause = "clocks-differ",
         .seen = {"the clock of gateway '" + safe(gateway.name) + "' is " +
                  seconds_text(ahead ? difference : -difference) +
                  (ahead ? " ahead of" : " behind") + " the clock of this host (time in " +
                  std::to_string(gateway.samples) + " samples compared with their reception)"},
         .means = "ages of values and times of events are wrong by this; with DDS-Security "
                  "certificates may count as expired",
         .advice = "run NTP or PTP on both hosts (chronyc tracking, timedatectl)"});
  }
}

}  // namespace linegate::doctor
