// SPDX-License-Identifier: Apache-2.0
// The network of this host: interfaces, whether they carry multicast, and open ports of DDS.
#pragma once

#include <string_view>
#include <vector>

#include "gateway/doctor/observations.h"

namespace linegate::doctor {

inline constexpr const char* kDiscoveryGroup = "239.255.0.1";  // RTPS 2.3 9.6.1.4.1

// Interfaces with IPv4 addresses, or that could have some. Sends one datagram to the group of
// discovery on each that carries multicast, to a port of its own, and waits up to 0.3 s for it.
std::vector<Interface> examine_interfaces();

// The DDS participants whose ports are in this text, which has the form of /proc/net/udp.
std::vector<LocalParticipant> participants_in(std::string_view proc_net_udp);
std::vector<LocalParticipant> local_participants();

}  // namespace linegate::doctor
