// SPDX-License-Identifier: Apache-2.0
// QoS policies of Fast DDS as plain values.
#pragma once

#include <cstdint>

#include <fastdds/dds/core/policy/QosPolicies.hpp>

#include "bridges/dds/observed.h"

namespace linegate::dds {

inline std::int64_t observed_time(const eprosima::fastrtps::Duration_t& it) {
  return it == eprosima::fastrtps::c_TimeInfinite ? ObservedQos::kInfinite : it.to_ns();
}

inline ObservedQos observed_qos(const eprosima::fastdds::dds::ReliabilityQosPolicy& reliability,
                                const eprosima::fastdds::dds::DurabilityQosPolicy& durability,
                                const eprosima::fastdds::dds::OwnershipQosPolicy& ownership,
                                const eprosima::fastdds::dds::DeadlineQosPolicy& deadline,
                                const eprosima::fastdds::dds::LivelinessQosPolicy& liveliness) {
  namespace fast = eprosima::fastdds::dds;
  return {.reliable = reliability.kind == fast::RELIABLE_RELIABILITY_QOS,
          .durability = static_cast<ObservedDurability>(durability.kind),
          .exclusive = ownership.kind == fast::EXCLUSIVE_OWNERSHIP_QOS,
          .deadline = observed_time(deadline.period),
          .liveliness = static_cast<ObservedLiveliness>(liveliness.kind),
          .lease = observed_time(liveliness.lease_duration)};
}

// Of a discovered writer or reader, and of an own DataReader.
template <class DiscoveredQos>
ObservedQos observed_qos(const DiscoveredQos& it) {
  ObservedQos out = observed_qos(it.m_reliability, it.m_durability, it.m_ownership, it.m_deadline,
                                 it.m_liveliness);
  for (const std::string& name : it.m_partition.names())
    out.partitions.push_back(name);
  return out;
}

}  // namespace linegate::dds
