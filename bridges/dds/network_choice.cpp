// SPDX-License-Identifier: Apache-2.0
#include "bridges/dds/network_choice.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <iterator>
#include <memory>
#include <string_view>

#include <arpa/inet.h>
#include <fastdds/rtps/attributes/ServerAttributes.h>
#include <fastdds/rtps/transport/UDPv4TransportDescriptor.h>
#include <fastdds/rtps/transport/shared_mem/SharedMemTransportDescriptor.h>
#include <fastrtps/utils/IPLocator.h>
#include <ifaddrs.h>
#include <netdb.h>
#include <netinet/in.h>
#include <sys/socket.h>

#include "bridges/dds/discovery_servers.h"
#include "bridges/dds/network_qos.h"

namespace linegate::dds {
namespace {

using eprosima::fastdds::rtps::get_server_client_default_guidPrefix;
using eprosima::fastdds::rtps::load_environment_server_info;
using eprosima::fastdds::rtps::RemoteServerAttributes;
using eprosima::fastdds::rtps::RemoteServerList_t;
using eprosima::fastrtps::rtps::DiscoveryProtocol_t;

constexpr const char* kAnnouncementGroup = "239.255.0.1";  // RTPS 2.3 9.6.1.4.1
constexpr std::string_view kLoopback = "127.0.0.1";

std::string ipv4_text(const sockaddr* it) {
  sockaddr_in address{};
  std::memcpy(&address, it, sizeof address);
  std::array<char, INET_ADDRSTRLEN> text{};
  ::inet_ntop(AF_INET, &address.sin_addr, text.data(), text.size());
  return text.data();
}

// A transport over UDPv4 of its own for this participant: that of the profile is shared.
std::shared_ptr<eprosima::fastdds::rtps::UDPv4TransportDescriptor> udp_of(
    eprosima::fastdds::dds::DomainParticipantQos& qos) {
  if (qos.transport().use_builtin_transports) {
    auto added = std::make_shared<eprosima::fastdds::rtps::UDPv4TransportDescriptor>();
    qos.transport().use_builtin_transports = false;
    qos.transport().user_transports.push_back(added);
    return added;
  }
  for (auto& transport : qos.transport().user_transports) {
    const auto* const udp =
        dynamic_cast<const eprosima::fastdds::rtps::UDPv4TransportDescriptor*>(transport.get());
    if (udp == nullptr)
      continue;
    auto copied = std::make_shared<eprosima::fastdds::rtps::UDPv4TransportDescriptor>(*udp);
    transport = copied;
    return copied;
  }
  return nullptr;
}

// Whether there is a transport over a network besides that one.
bool has_other_network(const eprosima::fastdds::dds::DomainParticipantQos& qos,
                       const eprosima::fastdds::rtps::UDPv4TransportDescriptor& udp) {
  using eprosima::fastdds::rtps::SharedMemTransportDescriptor;
  return std::ranges::any_of(qos.transport().user_transports, [&](const auto& it) {
    return it.get() != &udp &&
           dynamic_cast<const SharedMemTransportDescriptor*>(it.get()) == nullptr;
  });
}

// Port 0: the library takes those of the domain.
eprosima::fastrtps::rtps::Locator_t locator_to(const std::string& address) {
  eprosima::fastrtps::rtps::Locator_t out;
  out.kind = LOCATOR_KIND_UDPv4;
  eprosima::fastrtps::rtps::IPLocator::setIPv4(out, address);
  return out;
}

std::string apply_peers(const std::vector<std::string>& names,
                        eprosima::fastdds::dds::DomainParticipantQos& qos) {
  auto& peers = qos.wire_protocol().builtin.initialPeersList;
  if (peers.empty())  // the list replaces the multicast address
    peers.push_back(locator_to(kAnnouncementGroup));
  for (const std::string& name : names) {
    const std::string address = address_of_host(name);
    if (address.empty())
      return "the peer " + name + " has no IPv4 address";
    peers.push_back(locator_to(address));
  }
  return {};
}

std::string apply_servers(const NetworkChoice& choice,
                          eprosima::fastdds::dds::DomainParticipantQos& qos) {
  if (!choice.peers.empty())
    return "a participant with discovery servers announces itself to no peers";
  if (choice.multicast_images)
    return "discovery servers are for networks without multicast: there are no images by multicast";
  auto& config = qos.wire_protocol().builtin.discovery_config;
  config.discoveryProtocol = DiscoveryProtocol_t::CLIENT;
  config.m_DiscoveryServers.clear();
  for (std::size_t i = 0; i < choice.servers.size(); ++i) {
    const auto server = parse_discovery_server(choice.servers[i], i);
    if (!server)
      return "the discovery server \"" + choice.servers[i] + "\" is not [ID@]HOST[:PORT]";
    const std::string address = address_of_host(server->host);
    if (address.empty())
      return "the discovery server " + server->host + " has no IPv4 address";
    RemoteServerAttributes to;
    get_server_client_default_guidPrefix(server->id, to.guidPrefix);
    auto locator = locator_to(address);
    eprosima::fastrtps::rtps::IPLocator::setPhysicalPort(locator, server->port);
    to.metatrafficUnicastLocatorList.push_back(locator);
    config.m_DiscoveryServers.push_back(to);
  }
  return {};
}

}  // namespace

std::string address_of_host(const std::string& name) {
  addrinfo hints{};
  hints.ai_family = AF_INET;
  hints.ai_socktype = SOCK_DGRAM;
  addrinfo* found = nullptr;
  if (::getaddrinfo(name.c_str(), nullptr, &hints, &found) != 0 || found == nullptr)
    return {};
  std::string out = ipv4_text(found->ai_addr);
  ::freeaddrinfo(found);
  return out;
}

std::vector<std::string> addresses_of_interface(const std::string& name) {
  std::vector<std::string> out;
  ifaddrs* all = nullptr;
  if (::getifaddrs(&all) != 0)
    return out;
  for (const ifaddrs* it = all; it != nullptr; it = it->ifa_next) {
    if (it->ifa_addr == nullptr || it->ifa_addr->sa_family != AF_INET)
      continue;
    std::string address = ipv4_text(it->ifa_addr);
    if (name == it->ifa_name || name == address)
      out.push_back(std::move(address));
  }
  ::freeifaddrs(all);
  return out;
}

std::string apply(const NetworkChoice& choice, eprosima::fastdds::dds::DomainParticipantQos& qos) {
  if (choice.empty())
    return {};
  const auto udp = udp_of(qos);
  if (udp == nullptr)
    return "interfaces, peers, discovery servers and images by multicast need a profile with a "
           "transport UDPv4";
  if (!choice.interfaces.empty() && has_other_network(qos, *udp))
    return "interfaces need a profile whose only network transport is one UDPv4: others would be "
           "open on every interface";
  if (!choice.interfaces.empty())
    udp->interfaceWhiteList.clear();
  for (const std::string& name : choice.interfaces) {
    const auto addresses = addresses_of_interface(name);
    if (addresses.empty())
      return "there is no interface " + name + " with an IPv4 address";
    std::ranges::copy(addresses, std::back_inserter(udp->interfaceWhiteList));
  }
  // The library sends to an address of this host by loopback.
  if (!choice.interfaces.empty() && std::ranges::count(udp->interfaceWhiteList, kLoopback) == 0)
    udp->interfaceWhiteList.emplace_back(kLoopback);
  if (!choice.servers.empty())
    return apply_servers(choice, qos);
  if (choice.peers.empty())
    return {};
  udp->maxInitialPeersRange = std::max(udp->maxInitialPeersRange, kPeerParticipants);
  return apply_peers(choice.peers, qos);
}

std::string apply_environment(const NetworkChoice& choice, bool secured,
                              eprosima::fastdds::dds::DomainParticipantQos& qos) {
  auto& config = qos.wire_protocol().builtin.discovery_config;
  RemoteServerList_t servers;
  if (config.discoveryProtocol != DiscoveryProtocol_t::SIMPLE ||
      !load_environment_server_info(servers) || servers.empty())
    return {};
  if (secured || choice.multicast_images || !choice.peers.empty())
    return "the environment variable ROS_DISCOVERY_SERVER names discovery servers, which exclude "
           "peers, images by multicast and DDS-Security: unset it";
  config.discoveryProtocol = DiscoveryProtocol_t::CLIENT;
  config.m_DiscoveryServers = servers;
  return {};
}

}  // namespace linegate::dds
