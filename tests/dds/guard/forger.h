// SPDX-License-Identifier: Apache-2.0
// Sends forged datagrams to every participant of the test's domain on this host.
#pragma once

#include <cstdint>
#include <vector>

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include "tests/dds/own_domain.h"

namespace linegate::test {

class Forger {
 public:
  Forger() {
    const in_addr loopback{htonl(INADDR_LOOPBACK)};
    ::setsockopt(socket_, IPPROTO_IP, IP_MULTICAST_IF, &loopback, sizeof(loopback));
  }
  ~Forger() { ::close(socket_); }
  Forger(const Forger&) = delete;
  Forger& operator=(const Forger&) = delete;

  // Sends to the discovery and data ports (DDSI-RTPS 9.6.1.1) of the first participants.
  void unicast(const std::vector<std::uint8_t>& datagram) const {
    for (std::uint32_t participant = 0; participant < kParticipants; ++participant) {
      send(datagram, INADDR_LOOPBACK, 10 + 2 * participant);
      send(datagram, INADDR_LOOPBACK, 11 + 2 * participant);
    }
  }
  // Sends to the multicast port of discovery.
  void multicast(const std::vector<std::uint8_t>& datagram) const { send(datagram, 0xEFFF0001, 0); }

 private:
  static constexpr std::uint32_t kParticipants = 6;

  void send(const std::vector<std::uint8_t>& datagram, std::uint32_t address,
            std::uint32_t offset) const {
    sockaddr_in to{};
    to.sin_family = AF_INET;
    to.sin_port = htons(static_cast<std::uint16_t>(7400 + 250 * own_domain() + offset));
    to.sin_addr.s_addr = htonl(address);
    ::sendto(socket_, datagram.data(), datagram.size(), 0, reinterpret_cast<const sockaddr*>(&to),
             sizeof(to));
  }

  const int socket_ = ::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
};

}  // namespace linegate::test
