// SPDX-License-Identifier: Apache-2.0
// Endpoints in a partition in which the gateways have no counterpart.
#include <algorithm>
#include <set>

#include "gateway/doctor/checks.h"
#include "gateway/doctor/facts.h"

namespace linegate::doctor {

void check_partitions(const Observations& seen, Findings& found) {
  for (const dds::ObservedEndpoint& it : seen.endpoints) {
    if (is_of_gateway(seen, it))
      continue;
    std::set<std::string> there;
    bool fits = false;
    for (const dds::ObservedEndpoint& other : seen.endpoints) {
      if (other.writer == it.writer || other.topic != it.topic || other.type != it.type ||
          !is_of_gateway(seen, other))
        continue;
      there.insert(partitions_text(other.qos.partitions));
      fits = fits || partitions_fit(it.qos.partitions, other.qos.partitions);
    }
    if (fits || there.empty())
      continue;
    std::string gateways;
    for (const std::string& one : there)
      gateways += (gateways.empty() ? "" : "; ") + one;
    found.push_back(
        {.cause = "partition-mismatch",
         .seen = {"topic " + safe(it.topic) + ": the " + (it.writer ? "writer" : "reader") +
                      " of " + owner_text(seen, it) + " is in " +
                      partitions_text(it.qos.partitions),
                  "the gateways are in " + gateways},
         .means = "DDS delivers samples only between endpoints with a partition in common, and "
                  "reports nothing else",
         .advice = "give the program the partition GATEWAY/LINE of an existing line, or none"});
  }
}

}  // namespace linegate::doctor
