// SPDX-License-Identifier: Apache-2.0
// What `linegate doctor` has seen, without any conclusion. Checks (checks.h) draw these.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "bridges/dds/observed.h"
#include "stack/base/diagnostic.h"
#include "stack/base/time.h"

namespace linegate::doctor {

struct Interface {
  std::string name;
  bool up = false;
  bool running = false;  // with carrier
  bool loopback = false;
  bool multicast = false;              // the flag
  std::vector<std::string> addresses;  // IPv4
  // A datagram to the multicast address of discovery, sent and received on this interface.
  bool multicast_tested = false;
  bool multicast_received = false;
  std::string multicast_error;  // of the system; empty: none, the datagram did not come back
};

// Announcements of one participant that arrived by multicast.
struct Heard {
  dds::Announcement announcement;
  std::uint32_t domain = 0;  // of the port
  std::string from;          // address
  std::uint32_t count = 0;
  Duration first{};  // since the start of the observation
  Duration last{};
  bool left = false;  // it announced its end
};

enum class PortAnswer : std::uint8_t { silent, answered, refused, unreachable };

struct ProbedPort {
  std::uint16_t port = 0;
  PortAnswer answer{};
  std::string error;    // unreachable: of the system
  std::string program;  // answered: the name of the participant
};

// Announcements that were sent to a host by unicast.
struct ProbedHost {
  std::string name;     // as it was given
  std::string address;  // empty: the name is unknown
  bool given = false;   // as an argument or in the profile, not by an announcement
  bool named = false;   // given as an argument
  std::vector<ProbedPort> ports;
  ProbedPort closed;  // a port on which no participant listens: refused, if datagrams arrive
};

// A gateway whose state was received.
struct ReceivedGateway {
  std::string name;
  std::uint32_t samples = 0;    // of its state
  Duration clock_difference{};  // its clock minus the clock of this host, of the newest sample
  std::size_t participants = 0;
  std::size_t participants_most = 0;
  std::size_t lines = 0;
  std::uint32_t layouts = 0;  // that have entries
  std::uint32_t images = 0;
};

// Ports of a DDS participant that are open on this host (RTPS 2.3 9.6.1.1).
struct LocalParticipant {
  std::uint32_t domain = 0;
  std::uint32_t number = 0;
};

struct Observations {
  // The settings
  std::uint32_t domain = 0;
  std::string profile;     // file
  std::string identity;    // folder; empty: without DDS-Security
  bool multicast = false;  // images by multicast are asked for
  dds::NetworkProfile network;
  std::vector<Diagnostic> profile_findings;
  std::vector<Diagnostic> identity_findings;
  std::vector<Diagnostic> participant_findings;  // why there is no own participant
  // This host
  std::vector<Interface> interfaces;
  std::vector<LocalParticipant> local;
  // The network
  Duration watched{};
  std::vector<Heard> heard;  // without the own participant
  std::vector<ProbedHost> probes;
  std::string own_authority;  // of the own announcement
  // The domain
  std::vector<dds::ObservedParticipant> participants;
  std::vector<dds::ObservedEndpoint> endpoints;  // own ones included
  std::vector<ReceivedGateway> received;

  bool secured() const { return !identity.empty(); }
};

}  // namespace linegate::doctor
