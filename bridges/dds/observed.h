// SPDX-License-Identifier: Apache-2.0
// What other participants announce about themselves, as plain values for a diagnosis.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace linegate::dds {

using ObservedPrefix = std::array<std::uint8_t, 12>;  // GuidPrefix_t, RTPS 2.3 9.3.1.1
using ObservedGuid = std::array<std::uint8_t, 16>;    // prefix, then entity ID

struct UdpLocator {
  std::string address;  // IPv4, "192.168.7.10"
  std::uint16_t port = 0;

  friend bool operator==(const UdpLocator&, const UdpLocator&) = default;
};

// The announcement of a participant (SPDP, RTPS 2.3 8.5.3). It is not protected: a claim.
struct Announcement {
  ObservedPrefix prefix{};
  bool leaving = false;  // the participant ends; only the prefix is set then
  std::string name;      // up to 256 octets
  std::string host;      // as Fast DDS announces it; else empty
  std::optional<std::uint32_t> domain;
  bool secured = false;             // it has an identity token (DDS-Security 1.1 7.4.1.4)
  std::string authority;            // subject of the authority in that token; empty: none
  std::vector<UdpLocator> unicast;  // of discovery (metatraffic)
};

enum class ObservedDurability : std::uint8_t { volatile_, transient_local, transient, persistent };
enum class ObservedLiveliness : std::uint8_t { automatic, by_participant, by_topic };

// The policies of an endpoint that must fit those of its counterpart (DDS 1.4 2.2.3).
struct ObservedQos {
  static constexpr std::int64_t kInfinite = INT64_MAX;

  bool reliable = false;
  ObservedDurability durability{};
  bool exclusive = false;             // ownership
  std::int64_t deadline = kInfinite;  // ns
  ObservedLiveliness liveliness{};
  std::int64_t lease = kInfinite;         // ns, of the liveliness
  std::vector<std::string> partitions{};  // none: the default one, whose name is empty
};

struct ObservedEndpoint {
  ObservedGuid guid{};
  bool writer = false;
  bool own = false;  // of the participant that observes
  bool keyed = true;
  bool multicast = false;  // a writer that sends its images by multicast to readers that ask for it
  std::string topic;
  std::string type;
  ObservedQos qos;
};

struct ObservedParticipant {
  ObservedPrefix prefix{};
  std::string name;
  std::string host;
  bool refused = false;  // the authentication failed
};

struct ObservedServer {
  UdpLocator place;
  std::uint8_t id = 0;
  ObservedPrefix prefix{};
};

// The network part of a participant profile.
struct NetworkProfile {
  std::vector<UdpLocator> peers;        // initial peers by UDPv4; port 0: the ports of the domain
  std::vector<std::string> white_list;  // interfaces of all transports; none: each interface
  bool uses_udp = false;                // UDPv4
  std::vector<ObservedServer> servers;  // discovery servers by UDPv4
};

}  // namespace linegate::dds
