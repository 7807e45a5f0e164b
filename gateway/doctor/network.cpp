// SPDX-License-Identifier: Apache-2.0
#include "gateway/doctor/network.h"

#include <array>
#include <charconv>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <iterator>
#include <map>
#include <sstream>
#include <string>

#include <arpa/inet.h>
#include <ifaddrs.h>
#include <net/if.h>
#include <netinet/in.h>
#include <poll.h>

#include "gateway/doctor/socket.h"

namespace linegate::doctor {
namespace {

constexpr int kComesBackMs = 300;

std::vector<Interface> system_interfaces() {
  std::map<std::string, Interface> found;
  ifaddrs* all = nullptr;
  if (::getifaddrs(&all) != 0)
    return {};
  for (const ifaddrs* it = all; it != nullptr; it = it->ifa_next) {
    Interface& one = found[it->ifa_name];
    one.name = it->ifa_name;
    one.up = (it->ifa_flags & IFF_UP) != 0;
    one.running = (it->ifa_flags & IFF_RUNNING) != 0;
    one.loopback = (it->ifa_flags & IFF_LOOPBACK) != 0;
    one.multicast = (it->ifa_flags & IFF_MULTICAST) != 0;
    if (it->ifa_addr == nullptr || it->ifa_addr->sa_family != AF_INET)
      continue;
    sockaddr_in address{};
    std::memcpy(&address, it->ifa_addr, sizeof address);
    std::array<char, INET_ADDRSTRLEN> text{};
    ::inet_ntop(AF_INET, &address.sin_addr, text.data(), text.size());
    one.addresses.emplace_back(text.data());
  }
  ::freeifaddrs(all);
  std::vector<Interface> out;
  for (auto& [name, interface] : found)
    out.push_back(std::move(interface));
  return out;
}

void test_multicast(Interface& it) {
  const unsigned index = ::if_nametoindex(it.name.c_str());
  UdpSocket receiver;
  UdpSocket sender;
  if (index == 0 || !receiver.open() || !sender.open() ||
      receiver.bind(kDiscoveryGroup, 0, true) != 0)
    return;
  it.multicast_tested = true;
  int error = receiver.join(kDiscoveryGroup, index);
  if (error == 0) {
    constexpr std::array<std::uint8_t, 8> kText{'l', 'i', 'n', 'e', 'g', 'a', 't', 'e'};
    error = sender.send_on(index, kDiscoveryGroup, receiver.port(), kText);
  }
  if (error != 0) {
    it.multicast_error = std::strerror(error);
    return;
  }
  pollfd wait{.fd = receiver.descriptor(), .events = POLLIN, .revents = 0};
  it.multicast_received = ::poll(&wait, 1, kComesBackMs) == 1;
}

}  // namespace

std::vector<Interface> examine_interfaces() {
  std::vector<Interface> out = system_interfaces();
  for (Interface& it : out) {
    if (it.up && it.running && it.multicast && !it.addresses.empty())
      test_multicast(it);
  }
  return out;
}

// A line: "  12: 0100007F:1CF2 00000000:0000 07 ...", the port hexadecimal.
std::vector<LocalParticipant> participants_in(std::string_view proc_net_udp) {
  std::vector<LocalParticipant> out;
  std::istringstream in{std::string(proc_net_udp)};
  for (std::string line; std::getline(in, line);) {
    std::istringstream words(line);
    std::string number;
    std::string local;
    words >> number >> local;
    const std::size_t colon = local.find(':');
    unsigned port = 0;
    if (colon == std::string::npos ||
        std::from_chars(local.data() + colon + 1, local.data() + local.size(), port, 16).ec !=
            std::errc() ||
        port < 7400)
      continue;
    const std::uint32_t domain = (port - 7400) / 250;
    const std::uint32_t offset = (port - 7400) % 250;
    // The even ports from 10 on are those of discovery by unicast.
    if (domain <= 232 && offset >= 10 && offset % 2 == 0)
      out.push_back({domain, (offset - 10) / 2});
  }
  return out;
}

std::vector<LocalParticipant> local_participants() {
  std::ifstream file("/proc/net/udp");
  return participants_in(
      std::string(std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()));
}

}  // namespace linegate::doctor
