// SPDX-License-Identifier: Apache-2.0
#include "gateway/doctor/listener.h"

#include <algorithm>

#include <net/if.h>

#include "bridges/dds/announcement.h"
#include "gateway/doctor/network.h"

namespace linegate::doctor {
namespace {

constexpr std::uint32_t kLastDomain = 232;  // DDSI-RTPS 9.6.1.1: further ones have no ports
constexpr int kMostDatagrams = 256;         // of a domain, in one poll

}  // namespace

// Bound to the group and not to all addresses: otherwise this socket would take datagrams to a
// participant of this host that has the same port.
Listener::Listener(const std::vector<Interface>& interfaces) {
  for (std::uint32_t domain = 0; domain <= kLastDomain; ++domain) {
    UdpSocket socket;
    if (!socket.open() || socket.bind(kDiscoveryGroup, dds::multicast_port(domain), true) != 0)
      continue;
    for (const Interface& it : interfaces) {
      if (it.up && !it.addresses.empty())
        (void)socket.join(kDiscoveryGroup, ::if_nametoindex(it.name.c_str()));
    }
    sockets_.emplace_back(domain, std::move(socket));
  }
}

void Listener::poll(Duration now) {
  for (auto& [domain, socket] : sockets_) {
    for (int i = 0; i < kMostDatagrams; ++i) {
      const auto datagram = socket.receive();
      if (!datagram)
        break;
      take(domain, *datagram, now);
    }
  }
}

void Listener::take(std::uint32_t domain, const Datagram& datagram, Duration now) {
  auto announcement = dds::read_announcement(datagram.octets);
  if (!announcement)
    return;
  const auto known = std::ranges::find_if(heard_, [&](const Heard& it) {
    return it.announcement.prefix == announcement->prefix && it.domain == domain;
  });
  if (known == heard_.end()) {
    if (!announcement->leaving && heard_.size() < kMostHeard)
      heard_.push_back({std::move(*announcement), domain, datagram.from, 1, now, now, false});
    return;
  }
  known->left = announcement->leaving;
  if (announcement->leaving)
    return;
  ++known->count;
  known->last = now;
  known->announcement = std::move(*announcement);
}

}  // namespace linegate::doctor
