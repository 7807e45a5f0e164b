// SPDX-License-Identifier: Apache-2.0
// Checks whether a transport of a DDS profile can work.
#pragma once

#include <string>

#include <fastdds/rtps/transport/TransportDescriptorInterface.h>

namespace linegate::dds {

// Why Fast DDS 2.9.1 refuses the transport or cannot deliver anything with it; empty if no reason
// is known. Opens no socket; reads the names of the TLS files.
std::string transport_problem(const eprosima::fastdds::rtps::TransportDescriptorInterface& it);

}  // namespace linegate::dds
