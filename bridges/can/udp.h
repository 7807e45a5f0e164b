// SPDX-License-Identifier: Apache-2.0
// The channel "udp:GROUP:PORT": CAN frames in datagrams of a multicast group, in the format of
// python-can's interface udp_multicast. For machines without CAN, and for tests with foreign
// software.
//
//   udp:239.74.163.2:43113                       stays on this host: loopback, time to live 0
//   udp:[ff15::1]:43113                          IPv6
//   udp:239.74.163.2:43113?ttl=1                 leaves the host; the system selects the interface
//   udp:239.74.163.2:43113?ttl=1&interface=eth1  leaves the host by this interface
//
// There is no bus: no arbitration, no acknowledgement, no bit rate; the network may lose and
// reorder frames. Datagrams that are not frames are counted as malformed.
#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "bridges/can/channel.h"
#include "bridges/can/interface_uri.h"

namespace linegate::can_bridge {

struct UdpOptions {
  std::string group;       // a multicast address, IPv4 or IPv6 (without brackets)
  std::uint16_t port = 0;  // > 0
  std::uint8_t ttl = 0;    // time to live, hop limit
  std::string interface;  // network interface; empty: loopback with ttl 0, else the system's choice
};

struct ParsedUdp {
  UdpOptions options;
  std::string error;  // empty, or an error message
};
ParsedUdp udp_options(const InterfaceUri& uri);

// Never fails: the first read() reports errors, and opening is retried.
std::unique_ptr<Channel> open_udp(const UdpOptions& options);

}  // namespace linegate::can_bridge
