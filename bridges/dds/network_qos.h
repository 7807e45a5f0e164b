// SPDX-License-Identifier: Apache-2.0
// Applies a choice of interfaces and peers to the QoS of a participant.
#pragma once

#include <string>

#include <fastdds/dds/domain/qos/DomainParticipantQos.hpp>

#include "bridges/dds/network_choice.h"

namespace linegate::dds {

// Returns the reason for which the choice cannot be applied; empty if it was.
std::string apply(const NetworkChoice& choice, eprosima::fastdds::dds::DomainParticipantQos& qos);

// If neither the profile nor apply() chose a discovery protocol, uses the servers that the
// environment names, as the library itself would when the participant is created. Returns the
// reason for which they exclude the choice or DDS-Security; empty if they do not.
std::string apply_environment(const NetworkChoice& choice, bool secured,
                              eprosima::fastdds::dds::DomainParticipantQos& qos);

}  // namespace linegate::dds
