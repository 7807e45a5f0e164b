// SPDX-License-Identifier: Apache-2.0
// Endpoints in a partition in which the gateways have no counterpart.
#include <algorithm>
#include <set>

#include "gateway/doctor/checks.h"
#include "gateway/doctor/facts.h"

namespace linegate::doctor {

void check_partitions(const Observations& seen, Findings& found) {
  const std::vector<bool> of_gateway = of_gateways(seen);
  std::size_t reported = 0;
  for (std::size_t i = 0; i < seen.endpoints.size() && reported < kMostFindings; ++i) {
    const dds::ObservedEndpoint& it = seen.endpoints[i];
    if (of_gateway[i])
      continue;
    std::set<std::string> there;
    bool fits = false;
    for (std::size_t k = 0; k < seen.endpoints.size() && !fits; ++k) {
      const dds::ObservedEndpoint& other = seen.endpoints[k];
      if (other.writer == it.writer || other.topic != it.topic || other.type != it.type ||
          !of_gateway[k])
        continue;
      there.insert(partitions_text(other.qos.partitions));
      fits = fits || partitions_fit(it.qos.partitions, other.qos.partitions);
    }
    if (fits || there.empty())
      continue;
    ++reported;
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
