// SPDX-License-Identifier: Apache-2.0
// Whether other hosts can reach the participant of a profile without authentication.
#pragma once

#include <string>
#include <vector>

namespace linegate::dds {

// The transports of the participant profile that receive datagrams on other interfaces than
// loopback, "UDPv4 on 192.168.1.2" or "UDPv4 on every interface", in the order of the profile. Not
// listed: a transport whose white list has loopback addresses alone, SHM, TCP with TLS that
// requires a certificate of the peer. Empty with DDS-Security, or if the profiles are unusable
// (check_profiles()). file: as load_profiles(). interfaces: as NetworkChoice. Opens no socket of
// DDS.
std::vector<std::string> open_transports(const std::string& file,
                                         const std::vector<std::string>& interfaces = {});

}  // namespace linegate::dds
