// SPDX-License-Identifier: Apache-2.0
#include "bridges/dds/exposure.h"

#include <algorithm>
#include <string_view>

#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/rtps/transport/TCPv4TransportDescriptor.h>
#include <fastdds/rtps/transport/TCPv6TransportDescriptor.h>
#include <fastdds/rtps/transport/UDPv4TransportDescriptor.h>
#include <fastdds/rtps/transport/UDPv6TransportDescriptor.h>

#include "bridges/dds/network_qos.h"
#include "bridges/dds/profiles.h"
#include "stack/base/diagnostic.h"

namespace linegate::dds {
namespace {

namespace fast = eprosima::fastdds::dds;
namespace network = eprosima::fastdds::rtps;

bool is_loopback(std::string_view address) {
  return address.starts_with("127.") || address == "::1" || address == "lo";
}

// Without both modes the peer needs no certificate.
bool authenticates_peers(const network::TransportDescriptorInterface& it) {
  using Tls = network::TCPTransportDescriptor::TLSConfig;
  const auto* tcp = dynamic_cast<const network::TCPTransportDescriptor*>(&it);
  return tcp != nullptr && tcp->apply_security &&
         tcp->tls_config.get_verify_mode(Tls::TLSVerifyMode::VERIFY_PEER) &&
         tcp->tls_config.get_verify_mode(Tls::TLSVerifyMode::VERIFY_FAIL_IF_NO_PEER_CERT);
}

std::string type_of(const network::TransportDescriptorInterface& it) {
  if (dynamic_cast<const network::UDPv4TransportDescriptor*>(&it) != nullptr)
    return "UDPv4";
  if (dynamic_cast<const network::UDPv6TransportDescriptor*>(&it) != nullptr)
    return "UDPv6";
  return dynamic_cast<const network::TCPv4TransportDescriptor*>(&it) != nullptr ? "TCPv4" : "TCPv6";
}

// Empty: nowhere.
std::string open_on(const network::SocketTransportDescriptor& it) {
  if (it.interfaceWhiteList.empty())
    return "every interface";
  std::string out;
  for (const std::string& address : it.interfaceWhiteList) {
    if (!is_loopback(address))
      out += (out.empty() ? "" : ", ") + address;
  }
  return out;
}

bool is_secured(const fast::DomainParticipantQos& qos) {
  return std::ranges::any_of(qos.properties().properties(), [](const auto& property) {
    return property.name() == "dds.sec.auth.plugin";
  });
}

}  // namespace

std::vector<std::string> open_transports(const std::string& file,
                                         const std::vector<std::string>& interfaces) {
  std::vector<Diagnostic> unused;
  fast::DomainParticipantQos qos;
  std::vector<std::string> out;
  auto* factory = fast::DomainParticipantFactory::get_instance();
  if (!load_profiles(file, unused) ||
      factory->get_participant_qos_from_profile(kParticipantProfile, qos) !=
          eprosima::fastrtps::types::ReturnCode_t::RETCODE_OK ||
      is_secured(qos)) {
    return out;
  }
  // A participant with an interface that does not exist is not created.
  (void)apply({.interfaces = interfaces, .peers = {}}, qos);
  if (qos.transport().use_builtin_transports)
    out.emplace_back("UDPv4 on every interface");
  for (const auto& transport : qos.transport().user_transports) {
    const auto* sockets = dynamic_cast<const network::SocketTransportDescriptor*>(transport.get());
    if (sockets == nullptr || authenticates_peers(*sockets))
      continue;
    if (const std::string where = open_on(*sockets); !where.empty())
      out.push_back(type_of(*sockets) + " on " + where);
  }
  return out;
}

}  // namespace linegate::dds
