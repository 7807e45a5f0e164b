// SPDX-License-Identifier: Apache-2.0
#include "tests/dds/flood/capture.h"

#include <algorithm>
#include <array>

#include <arpa/inet.h>
#include <linux/if_ether.h>
#include <linux/if_packet.h>
#include <net/if.h>
#include <sys/socket.h>
#include <unistd.h>

namespace linegate::flood {
namespace {

constexpr std::size_t kMostKinds = 4'096;

std::uint16_t big_endian(const std::uint8_t* at) {
  return static_cast<std::uint16_t>(at[0] << 8U | at[1]);
}

// The RTPS datagram in an IPv4 packet; without octets if the packet has none.
Seen rtps_of(const std::uint8_t* packet, std::size_t size) {
  constexpr std::size_t kUdp = 8;
  Seen out;
  if (size < 20 || packet[0] >> 4U != 4 || packet[9] != IPPROTO_UDP)
    return out;
  const std::size_t ip = (packet[0] & 0x0FU) * 4U;
  if (size < ip + kUdp + 20 || packet[ip + kUdp] != 'R' || packet[ip + kUdp + 1] != 'T')
    return out;
  out.from = big_endian(packet + ip);
  out.port = big_endian(packet + ip + 2);
  out.octets.assign(packet + ip + kUdp, packet + size);
  return out;
}

}  // namespace

Capture::Capture(std::uint32_t domain) : first_(static_cast<std::uint16_t>(7'400 + 250 * domain)) {
  socket_ = ::socket(AF_PACKET, SOCK_DGRAM | SOCK_CLOEXEC, htons(ETH_P_IP));
  sockaddr_ll address{};
  address.sll_family = AF_PACKET;
  address.sll_protocol = htons(ETH_P_IP);
  address.sll_ifindex = static_cast<int>(::if_nametoindex("lo"));
  if (socket_ >= 0 &&
      ::bind(socket_, reinterpret_cast<const sockaddr*>(&address), sizeof(address)) != 0) {
    ::close(socket_);
    socket_ = -1;
  }
  const int room = 8 << 20;
  ::setsockopt(socket_, SOL_SOCKET, SO_RCVBUF, &room, sizeof(room));
}

Capture::~Capture() {
  if (socket_ >= 0)
    ::close(socket_);
}

std::vector<Seen> Capture::read() {
  std::vector<Seen> out;
  static std::array<std::uint8_t, 70'000> packet;
  for (;;) {
    sockaddr_ll from{};
    socklen_t length = sizeof(from);
    const ssize_t size = ::recvfrom(socket_, packet.data(), packet.size(), MSG_DONTWAIT,
                                    reinterpret_cast<sockaddr*>(&from), &length);
    if (size <= 0)
      return out;
    // The loopback interface shows each packet twice: outgoing and incoming.
    if (from.sll_pkttype == PACKET_OUTGOING)
      continue;
    Seen seen = rtps_of(packet.data(), static_cast<std::size_t>(size));
    if (!seen.octets.empty() && seen.port >= first_ && seen.port < first_ + 250)
      out.push_back(std::move(seen));
  }
}

void Seeds::add(const Seen& seen) {
  std::string key = std::to_string(seen.port);
  for (const Part& part : split(seen.octets)) {
    key.push_back(static_cast<char>(part.kind));
    const std::size_t writer = part.is_data() ? 8 : 4;
    const bool has_writer =
        part.kind >= 0x06 && part.kind <= 0x16 && part.kind != 0x09 && part.kind != 0x0E;
    if (has_writer && part.body.size() >= writer + 4)
      key.append(part.body.begin() + static_cast<std::ptrdiff_t>(writer),
                 part.body.begin() + static_cast<std::ptrdiff_t>(writer + 4));
    if (part.is_data())
      key.push_back(static_cast<char>(part.flags));
  }
  const auto known = places_.find(key);
  if (known == places_.end()) {
    if (kinds_.size() == kMostKinds)
      return;
    places_.emplace(std::move(key), kinds_.size());
    kinds_.push_back({{seen}, 0});
    return;
  }
  Kind& kind = kinds_[known->second];
  if (kind.newest.size() < kEach)
    return kind.newest.push_back(seen);
  kind.newest[kind.next++ % kEach] = seen;
}

const Seen& Seeds::pick(Mutator& random) const {
  const Kind& kind = kinds_[random.below(kinds_.size())];
  return kind.newest[random.below(kind.newest.size())];
}

}  // namespace linegate::flood
