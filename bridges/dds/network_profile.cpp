// SPDX-License-Identifier: Apache-2.0
#include "bridges/dds/network_profile.h"

#include <algorithm>

#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/rtps/transport/SocketTransportDescriptor.h>
#include <fastdds/rtps/transport/UDPv4TransportDescriptor.h>
#include <fastrtps/utils/IPLocator.h>

#include "bridges/dds/network_qos.h"
#include "bridges/dds/profiles.h"
#include "stack/base/diagnostic.h"

namespace linegate::dds {
namespace {

using eprosima::fastrtps::rtps::IPLocator;
using eprosima::fastrtps::rtps::Locator_t;

UdpLocator udp_locator(const Locator_t& from) {
  return {IPLocator::toIPv4string(from),
          static_cast<std::uint16_t>(IPLocator::getPhysicalPort(from))};
}

std::vector<ObservedServer> servers_in(const eprosima::fastdds::dds::DomainParticipantQos& qos) {
  constexpr std::size_t kIdAt = 2;  // octet in the GUID prefix of a server
  std::vector<ObservedServer> out;
  for (const auto& server : qos.wire_protocol().builtin.discovery_config.m_DiscoveryServers) {
    for (const Locator_t& locator : server.metatrafficUnicastLocatorList) {
      if (locator.kind != LOCATOR_KIND_UDPv4)
        continue;
      ObservedServer& to = out.emplace_back();
      to.place = udp_locator(locator);
      std::copy_n(server.guidPrefix.value, to.prefix.size(), to.prefix.begin());
      to.id = to.prefix[kIdAt];
    }
  }
  return out;
}

}  // namespace

NetworkProfile network_profile(const std::string& file, const NetworkChoice& choice) {
  NetworkProfile out;
  std::vector<Diagnostic> unused;
  eprosima::fastdds::dds::DomainParticipantQos qos;
  auto* factory = eprosima::fastdds::dds::DomainParticipantFactory::get_instance();
  if (!load_profiles(file, unused) ||
      factory->get_participant_qos_from_profile(kParticipantProfile, qos) !=
          eprosima::fastrtps::types::ReturnCode_t::RETCODE_OK) {
    return out;
  }
  (void)apply(choice, qos);
  (void)apply_environment(choice, false, qos);
  for (const Locator_t& peer : qos.wire_protocol().builtin.initialPeersList) {
    if (peer.kind == LOCATOR_KIND_UDPv4) {
      out.peers.push_back(udp_locator(peer));
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
  out.servers = servers_in(qos);
  return out;
}

}  // namespace linegate::dds
