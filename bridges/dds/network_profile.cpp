// SPDX-License-Identifier: Apache-2.0
#include "bridges/dds/network_profile.h"

#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/rtps/transport/SocketTransportDescriptor.h>
#include <fastdds/rtps/transport/UDPv4TransportDescriptor.h>
#include <fastrtps/utils/IPLocator.h>

#include "bridges/dds/profiles.h"
#include "stack/base/diagnostic.h"

namespace linegate::dds {

NetworkProfile network_profile(const std::string& file) {
  namespace rtps = eprosima::fastrtps::rtps;
  NetworkProfile out;
  std::vector<Diagnostic> unused;
  eprosima::fastdds::dds::DomainParticipantQos qos;
  auto* factory = eprosima::fastdds::dds::DomainParticipantFactory::get_instance();
  if (!load_profiles(file, unused) ||
      factory->get_participant_qos_from_profile(kParticipantProfile, qos) !=
          eprosima::fastrtps::types::ReturnCode_t::RETCODE_OK) {
    return out;
  }
  for (const rtps::Locator_t& peer : qos.wire_protocol().builtin.initialPeersList) {
    if (peer.kind == LOCATOR_KIND_UDPv4) {
      out.peers.push_back({rtps::IPLocator::toIPv4string(peer),
                           static_cast<std::uint16_t>(rtps::IPLocator::getPhysicalPort(peer))});
    }
  }
  out.uses_udp = qos.transport().use_builtin_transports;
  for (const auto& transport : qos.transport().user_transports) {
    const auto* const sockets =
        dynamic_cast<const eprosima::fastdds::rtps::SocketTransportDescriptor*>(transport.get());
    if (sockets == nullptr)
      continue;
    out.uses_udp =
        out.uses_udp ||
        dynamic_cast<const eprosima::fastdds::rtps::UDPv4TransportDescriptor*>(sockets) != nullptr;
    for (const std::string& interface : sockets->interfaceWhiteList)
      out.white_list.push_back(interface);
  }
  const auto protocol = qos.wire_protocol().builtin.discovery_config.discoveryProtocol;
  out.simple_discovery = protocol == rtps::DiscoveryProtocol_t::SIMPLE;
  return out;
}

}  // namespace linegate::dds
