// SPDX-License-Identifier: Apache-2.0
// Installs a guard between the transports of a participant and Fast DDS.
#pragma once

#include <memory>
#include <string>

#include <fastdds/dds/domain/qos/DomainParticipantQos.hpp>

#include "bridges/dds/guard/guard.h"

namespace linegate::dds::guard {

// Replaces every transport of the QoS, including built-in ones, by a guarded one. Sent datagrams
// are unchanged; with protection they are kProtectionRoom shorter, see message_room.h. Supports
// UDPv4, UDPv6, TCP and shared memory; other transports are wrapped in the same way.
void wrap_transports(eprosima::fastdds::dds::DomainParticipantQos& qos,
                     const std::shared_ptr<Guard>& guard);

// Whether the participant has a TCP transport. Call it before wrap_transports().
bool has_tcp(const eprosima::fastdds::dds::DomainParticipantQos& qos);

// The limits for a QoS with a bounded number of participants: that bound, and the hosts of its
// initial peers.
DiscoveryLimits discovery_limits(const eprosima::fastdds::dds::DomainParticipantQos& qos);

// Whether the DDS-Security properties of the QoS name a governance document that protects RTPS
// messages. A document that cannot be read counts as protecting them.
bool requires_protection(const eprosima::fastdds::dds::DomainParticipantQos& qos);

}  // namespace linegate::dds::guard
