// SPDX-License-Identifier: Apache-2.0
// Endpoints of one topic with different types: DDS reports nothing to either side.
#include <algorithm>
#include <set>

#include "gateway/doctor/checks.h"
#include "gateway/doctor/facts.h"

namespace linegate::doctor {
namespace {

// Whether an endpoint of the other direction has the same topic and type.
bool has_counterpart(const Observations& seen, const dds::ObservedEndpoint& it) {
  return std::ranges::any_of(seen.endpoints, [&](const dds::ObservedEndpoint& other) {
    return other.writer != it.writer && other.topic == it.topic && other.type == it.type &&
           other.keyed == it.keyed;
  });
}

std::string type_text(const dds::ObservedEndpoint& it) {
  return safe(it.type) + (it.keyed ? "" : " (without a key)");
}

}  // namespace

void check_types(const Observations& seen, Findings& found) {
  std::set<std::string> reported;
  const std::vector<bool> gateways = of_gateways(seen);
  for (std::size_t i = 0; i < seen.endpoints.size() && reported.size() < kMostFindings; ++i) {
    const dds::ObservedEndpoint& it = seen.endpoints[i];
    if (gateways[i] || has_counterpart(seen, it))
      continue;
    for (std::size_t k = 0; k < seen.endpoints.size() && reported.size() < kMostFindings; ++k) {
      const dds::ObservedEndpoint& other = seen.endpoints[k];
      if (other.writer == it.writer || other.topic != it.topic || !gateways[k])
        continue;
      const std::string evidence = "topic " + safe(it.topic) + ": the " +
                                   (it.writer ? "writer" : "reader") + " of " +
                                   owner_text(seen, it) + " has type " + type_text(it) + ", " +
                                   owner_text(seen, other) + " has type " + type_text(other);
      if (!reported.insert(evidence).second)
        continue;
      const bool contract = it.topic.starts_with("linegate/");
      found.push_back({.cause = "type-mismatch",
                       .seen = {evidence},
                       .means = contract ? "the program was built with another version of the "
                                           "contract: nothing is delivered, and DDS reports nothing"
                                         : "the device has changed since the types of the program "
                                           "were made: nothing is delivered, and DDS reports "
                                           "nothing",
                       .advice = contract ? "build the program with idl/linegate.idl of this "
                                            "version"
                                          : "print the types again with linegate idl PLANT, and "
                                            "build the program with them"});
    }
  }
}

}  // namespace linegate::doctor
