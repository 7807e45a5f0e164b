// SPDX-License-Identifier: Apache-2.0
// Writers and readers whose QoS does not fit (DDS 1.4 2.2.3).
#include <set>

#include "gateway/doctor/checks.h"
#include "gateway/doctor/facts.h"

namespace linegate::doctor {
namespace {

std::string durability_text(dds::ObservedDurability it) {
  switch (it) {
    case dds::ObservedDurability::volatile_:
      return "VOLATILE";
    case dds::ObservedDurability::transient_local:
      return "TRANSIENT_LOCAL";
    case dds::ObservedDurability::transient:
      return "TRANSIENT";
    case dds::ObservedDurability::persistent:
      break;
  }
  return "PERSISTENT";
}

std::string liveliness_text(dds::ObservedLiveliness it) {
  switch (it) {
    case dds::ObservedLiveliness::automatic:
      return "AUTOMATIC";
    case dds::ObservedLiveliness::by_participant:
      return "MANUAL_BY_PARTICIPANT";
    case dds::ObservedLiveliness::by_topic:
      break;
  }
  return "MANUAL_BY_TOPIC";
}

std::string time_text(std::int64_t ns) {
  return ns == dds::ObservedQos::kInfinite ? "infinite" : seconds_text(Duration(ns));
}

struct Difference {
  std::string policy;
  std::string offered;
  std::string requested;
};

std::vector<Difference> differences(const dds::ObservedQos& offered,
                                    const dds::ObservedQos& requested) {
  std::vector<Difference> out;
  if (requested.reliable && !offered.reliable)
    out.push_back({"RELIABILITY", "BEST_EFFORT", "RELIABLE"});
  if (requested.durability > offered.durability)
    out.push_back(
        {"DURABILITY", durability_text(offered.durability), durability_text(requested.durability)});
  if (requested.exclusive != offered.exclusive)
    out.push_back({"OWNERSHIP", offered.exclusive ? "EXCLUSIVE" : "SHARED",
                   requested.exclusive ? "EXCLUSIVE" : "SHARED"});
  if (requested.deadline < offered.deadline)
    out.push_back({"DEADLINE", time_text(offered.deadline), time_text(requested.deadline)});
  if (requested.liveliness > offered.liveliness)
    out.push_back(
        {"LIVELINESS", liveliness_text(offered.liveliness), liveliness_text(requested.liveliness)});
  if (requested.lease < offered.lease)
    out.push_back({"LIVELINESS lease", time_text(offered.lease), time_text(requested.lease)});
  return out;
}

}  // namespace

void check_qos(const Observations& seen, Findings& found) {
  std::set<std::string> reported;
  const std::vector<bool> gateways = of_gateways(seen);
  for (std::size_t i = 0; i < seen.endpoints.size() && reported.size() < kMostFindings; ++i) {
    for (std::size_t k = 0; k < seen.endpoints.size() && reported.size() < kMostFindings; ++k) {
      const dds::ObservedEndpoint& writer = seen.endpoints[i];
      const dds::ObservedEndpoint& reader = seen.endpoints[k];
      if (!writer.writer || reader.writer || writer.topic != reader.topic ||
          writer.type != reader.type || gateways[i] == gateways[k] ||
          !partitions_fit(writer.qos.partitions, reader.qos.partitions))
        continue;
      const std::string sender = owner_text(seen, writer);
      const std::string receiver = owner_text(seen, reader);
      for (const Difference& it : differences(writer.qos, reader.qos)) {
        const std::string evidence = "topic " + safe(writer.topic) + ", policy " + it.policy +
                                     ": the writer of " + sender + " offers " + it.offered +
                                     ", the reader of " + receiver + " requests " + it.requested;
        if (!reported.insert(evidence).second)
          continue;
        found.push_back({.cause = "qos-mismatch",
                         .seen = {evidence},
                         .means = "DDS delivers no sample of this topic from the one to the other",
                         .advice = "give the program that is not the gateway the QoS of "
                                   "idl/README.md; this program and the gateway have theirs from "
                                   "a file of QoS profiles"});
      }
    }
  }
}

}  // namespace linegate::doctor
