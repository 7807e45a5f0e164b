// SPDX-License-Identifier: Apache-2.0
// Discovery servers of Fast DDS: participants that pass the announcements of others on, where no
// multicast does.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace linegate::dds {

struct DiscoveryServer {
  static constexpr std::uint16_t kUsualPort = 11811;

  std::uint8_t id = 0;  // of `fastdds discovery -i`; its GUID prefix contains it
  std::string host;     // name or IPv4 address
  std::uint16_t port = kUsualPort;

  friend bool operator==(const DiscoveryServer&, const DiscoveryServer&) = default;
};

// Reads [ID@]HOST[:PORT]: "192.168.7.2", "2@server.plant:11888". position: in the list of servers,
// from 0, which is the ID if the text has none, as in the variable ROS_DISCOVERY_SERVER of ROS 2.
std::optional<DiscoveryServer> parse_discovery_server(std::string_view text, std::size_t position);

}  // namespace linegate::dds
