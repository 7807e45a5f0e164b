// SPDX-License-Identifier: Apache-2.0
// The interfaces of a participant, the hosts that it announces itself to, or the servers by which
// it is discovered, and the group of its process images, chosen beside the profile.
#pragma once

#include <string>
#include <vector>

namespace linegate::dds {

struct NetworkChoice {
  // Interfaces of this host, by name or IPv4 address, and loopback. None: those of the profile.
  std::vector<std::string> interfaces;
  // Hosts that multicast does not reach, by name or IPv4 address, besides those of the profile.
  // Announcements go to the ports of the first kPeerParticipants participants of each.
  std::vector<std::string> peers;
  // Discovery servers (parse_discovery_server()), by which participants are discovered instead of
  // by multicast and peers. None: those of the environment (ROS_DISCOVERY_SERVER), or of the
  // profile.
  std::vector<std::string> servers;
  // Process images by multicast (fan_out.h): writers send them once to all readers that ask for it,
  // and readers ask for it. Needs the guard, and no DDS-Security.
  bool multicast_images = false;

  bool empty() const {
    return interfaces.empty() && peers.empty() && servers.empty() && !multicast_images;
  }
};

inline constexpr unsigned kPeerParticipants = 20;

// The IPv4 address of a host; empty if the name has none. May wait for a name server.
std::string address_of_host(const std::string& name);
// The IPv4 addresses of an interface with that name or address; none: there is no such interface,
// or it has no address.
std::vector<std::string> addresses_of_interface(const std::string& name);

}  // namespace linegate::dds
