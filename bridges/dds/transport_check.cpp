// SPDX-License-Identifier: Apache-2.0
#include "bridges/dds/transport_check.h"

#include <cstdint>
#include <fstream>

#include <fastdds/rtps/transport/TCPv4TransportDescriptor.h>
#include <fastdds/rtps/transport/TCPv6TransportDescriptor.h>
#include <fastdds/rtps/transport/TransportInterface.h>
#include <fastdds/rtps/transport/UDPv4TransportDescriptor.h>
#include <fastdds/rtps/transport/UDPv6TransportDescriptor.h>
#include <fastdds/rtps/transport/shared_mem/SharedMemTransportDescriptor.h>

namespace linegate::dds {
namespace {

namespace network = eprosima::fastdds::rtps;

// Room for an RTPS header, INFO_DST, INFO_TS and the announcement of a participant with its
// locators.
constexpr std::uint32_t kSmallestMessage = 1024;

template <class Kind>
bool is_a(const network::TransportDescriptorInterface& it) {
  return dynamic_cast<const Kind*>(&it) != nullptr;
}

// The rules of UDPTransportInterface::init and TCPTransportInterface::init. A buffer size of 0
// selects the system's default.
std::string problem_of_sizes(const network::SocketTransportDescriptor& it) {
  if (it.maxMessageSize > network::s_maximumMessageSize)
    return "its maxMessageSize is above " + std::to_string(network::s_maximumMessageSize);
  if (it.sendBufferSize != 0 && it.maxMessageSize > it.sendBufferSize)
    return "its maxMessageSize is above its sendBufferSize";
  if (it.receiveBufferSize != 0 && it.maxMessageSize > it.receiveBufferSize)
    return "its maxMessageSize is above its receiveBufferSize";
  return "";
}

// If the file is missing, the library continues, but no connection is ever established.
std::string problem_of_tls(const network::TCPTransportDescriptor& it) {
  if (!it.apply_security)
    return "";
  const auto& tls = it.tls_config;
  for (const std::string& file :
       {tls.verify_file, tls.cert_chain_file, tls.private_key_file, tls.tmp_dh_file}) {
    if (!file.empty() && !std::ifstream(file))
      return "cannot read " + file + ", which its <tls> names";
  }
  return "";
}

}  // namespace

std::string transport_problem(const network::TransportDescriptorInterface& it) {
  if (is_a<network::TCPv6TransportDescriptor>(it))
    return "with TCPv6 nothing is received in Fast DDS 2.9.1: use UDPv6 or TCPv4";
  const bool known = is_a<network::UDPv4TransportDescriptor>(it) ||
                     is_a<network::UDPv6TransportDescriptor>(it) ||
                     is_a<network::TCPv4TransportDescriptor>(it) ||
                     is_a<network::SharedMemTransportDescriptor>(it);
  if (!known)
    return "it is none of UDPv4, UDPv6, TCPv4 and SHM";
  if (it.max_message_size() < kSmallestMessage)
    return "its maxMessageSize is below " + std::to_string(kSmallestMessage) +
           ": no announcement fits";
  if (const auto* shared = dynamic_cast<const network::SharedMemTransportDescriptor*>(&it)) {
    const bool fits =
        shared->segment_size() == 0 || shared->max_message_size() <= shared->segment_size();
    return fits ? "" : "its maxMessageSize is above its segment_size";
  }
  if (const auto* sockets = dynamic_cast<const network::SocketTransportDescriptor*>(&it)) {
    if (std::string why = problem_of_sizes(*sockets); !why.empty())
      return why;
  }
  const auto* tcp = dynamic_cast<const network::TCPTransportDescriptor*>(&it);
  return tcp == nullptr ? "" : problem_of_tls(*tcp);
}

}  // namespace linegate::dds
