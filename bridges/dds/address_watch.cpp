// SPDX-License-Identifier: Apache-2.0
#include "bridges/dds/address_watch.h"

#include <algorithm>
#include <array>

#include <arpa/inet.h>
#include <ifaddrs.h>
#include <net/if.h>
#include <netinet/in.h>

namespace linegate::dds {

std::set<std::string> usable_addresses() {
  std::set<std::string> out;
  ifaddrs* all = nullptr;
  if (::getifaddrs(&all) != 0)
    return out;  // none is new
  for (const ifaddrs* one = all; one != nullptr; one = one->ifa_next) {
    const bool running = (one->ifa_flags & IFF_UP) != 0 && (one->ifa_flags & IFF_RUNNING) != 0;
    if (!running || one->ifa_addr == nullptr || one->ifa_addr->sa_family != AF_INET)
      continue;
    const void* const address = one->ifa_addr;
    std::array<char, INET_ADDRSTRLEN> text{};
    ::inet_ntop(AF_INET, &static_cast<const sockaddr_in*>(address)->sin_addr, text.data(),
                text.size());
    out.insert(std::string(one->ifa_name) + ' ' + text.data());
  }
  ::freeifaddrs(all);
  return out;
}

bool AddressWatch::has_new(const std::set<std::string>& now) const {
  return !std::ranges::includes(known_, now);
}

}  // namespace linegate::dds
