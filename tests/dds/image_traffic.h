// SPDX-License-Identifier: Apache-2.0
// Where the samples of each writer go: the UDP datagrams of this network namespace's loopback.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <set>
#include <utility>
#include <vector>

#include <arpa/inet.h>
#include <linux/if_packet.h>
#include <net/ethernet.h>
#include <net/if.h>
#include <sys/socket.h>
#include <unistd.h>

#include "bridges/dds/guard/submessages.h"

namespace linegate::test {

// A packet socket on "lo". Needs CAP_NET_RAW, which root of a network namespace has.
class ImageTraffic {
 public:
  // An IPv4 address in host order, and a port.
  using Place = std::pair<std::uint32_t, std::uint16_t>;
  // A sample: its writer, and its number.
  using Sample = std::pair<dds::guard::Guid, std::int64_t>;

  ImageTraffic() {
    sockaddr_ll address{};
    address.sll_family = AF_PACKET;
    address.sll_protocol = htons(ETH_P_IP);
    address.sll_ifindex = static_cast<int>(::if_nametoindex("lo"));
    constexpr int kRoom = 8'000'000;
    ::setsockopt(socket_, SOL_SOCKET, SO_RCVBUFFORCE, &kRoom, sizeof(kRoom));
    ok_ = socket_ >= 0 &&
          ::bind(socket_, reinterpret_cast<const sockaddr*>(&address), sizeof(address)) == 0;
  }
  ~ImageTraffic() { ::close(socket_); }
  ImageTraffic(const ImageTraffic&) = delete;
  ImageTraffic& operator=(const ImageTraffic&) = delete;

  bool ok() const { return ok_; }

  // Forgets what was seen, and what waits in the socket.
  void begin() {
    read();
    samples.clear();
    groups.clear();
    piggybacked.clear();
  }

  void read() {
    std::vector<std::uint8_t> packet(65'536);
    sockaddr_ll from{};
    socklen_t length = sizeof(from);
    for (;;) {
      const auto size = ::recvfrom(socket_, packet.data(), packet.size(), MSG_DONTWAIT,
                                   reinterpret_cast<sockaddr*>(&from), &length);
      if (size < 0)
        return;
      if (from.sll_pkttype != PACKET_OUTGOING)  // each is seen twice on loopback
        add({packet.data(), static_cast<std::size_t>(size)});
    }
  }

  // Ignores datagrams of other processes from now on: other tests use this loopback, too.
  void only_of(pid_t process) {
    processes_.insert(low_octets(static_cast<std::uint32_t>(process)));
  }

  // Of each sample of an application's writer: the places that it was sent to.
  std::map<Sample, std::multiset<Place>> samples;
  std::set<Place> groups;  // all multicast destinations
  // The places of datagrams in which a sample of an application's writer is followed by a
  // heartbeat.
  std::multiset<Place> piggybacked;

 private:
  void add(dds::guard::Octets packet) {
    constexpr std::size_t kUdp = 8;
    const std::size_t header = (packet[0] & 0x0FU) * 4U;
    if (packet.size() < header + kUdp || packet[9] != IPPROTO_UDP)
      return;
    const dds::guard::Wire wire(packet, false);
    const Place to{wire.u32(16), wire.u16(header + 2)};
    const dds::guard::Octets datagram = packet.subspan(header + kUdp);
    if (!processes_.empty() && !is_of_them(datagram))
      return;
    if (to.first >> 28U == 0xE)
      groups.insert(to);
    add_samples(datagram, to);
  }

  // Fast DDS has them in a GUID prefix, behind vendor and host.
  static std::uint16_t low_octets(std::uint32_t process) {
    return static_cast<std::uint16_t>(process);
  }
  bool is_of_them(dds::guard::Octets datagram) const {
    constexpr std::size_t kProcessAt = 8 + 4;  // in the header of RTPS
    return dds::guard::has_header(datagram) &&
           processes_.contains(dds::guard::Wire(datagram, true).u16(kProcessAt));
  }

  void add_samples(dds::guard::Octets datagram, const Place& to) {
    using namespace dds::guard;
    if (!has_header(datagram))
      return;
    Prefix source{};
    std::copy_n(datagram.begin() + 8, source.size(), source.begin());
    Submessage submessage;
    std::set<Guid> sampled;
    for (std::size_t at = kHeader; at < datagram.size(); at += 4 + submessage.body.size()) {
      Content content;
      if (split(datagram, at, submessage) != Reason::none ||
          check(submessage, content) != Reason::none)
        return;
      if ((content.writer & 0xC0U) != 0)
        continue;
      const Guid writer = make_guid(source, content.writer);
      if (submessage.kind == Kind::data) {
        samples[{writer, content.highest}].insert(to);
        sampled.insert(writer);
      } else if (submessage.kind == Kind::heartbeat && sampled.contains(writer)) {
        piggybacked.insert(to);
      }
    }
  }

  std::set<std::uint16_t> processes_;
  const int socket_ = ::socket(AF_PACKET, SOCK_DGRAM | SOCK_CLOEXEC, htons(ETH_P_IP));
  bool ok_ = false;
};

}  // namespace linegate::test
