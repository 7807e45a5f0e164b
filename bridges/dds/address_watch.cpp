// SPDX-License-Identifier: Apache-2.0
#include "bridges/dds/address_watch.h"

#include <algorithm>
#include <array>
#include <string_view>

#include <arpa/inet.h>
#include <ifaddrs.h>
#include <net/if.h>
#include <netinet/in.h>

namespace linegate::dds {
namespace {

// wanted: the name of an interface, or an address.
bool is_of(const std::string& one, std::string_view wanted) {
  const std::size_t space = one.find(' ');
  return std::string_view(one).substr(0, space) == wanted ||
         std::string_view(one).substr(space + 1) == wanted;
}

}  // namespace

std::set<std::string> usable_addresses() {
  std::set<std::string> out;
  ifaddrs* all = nullptr;
  if (::getifaddrs(&all) != 0)
    return out;  // none is new
  for (const ifaddrs* one = all; one != nullptr; one = one->ifa_next) {
    const bool running = (one->ifa_flags & IFF_UP) != 0 && (one->ifa_flags & IFF_RUNNING) != 0;
    if (!running || (one->ifa_flags & IFF_LOOPBACK) != 0 || one->ifa_addr == nullptr ||
        one->ifa_addr->sa_family != AF_INET)
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

AddressWatch::Addresses AddressWatch::present() const {
  Addresses all = host_();
  if (!interfaces_.empty()) {
    std::erase_if(all, [&](const std::string& one) {
      return std::ranges::none_of(interfaces_,
                                  [&](const std::string& wanted) { return is_of(one, wanted); });
    });
  }
  return all;
}

void AddressWatch::look() {
  seen_ = present();
}

void AddressWatch::created() {
  used_ = seen_;
  narrow();
}

void AddressWatch::narrow() {
  look();
  std::erase_if(used_, [this](const std::string& one) { return !seen_.contains(one); });
}

std::string AddressWatch::added() {
  look();
  const bool complete = std::ranges::all_of(interfaces_, [this](const std::string& wanted) {
    return wanted == "lo" || wanted.starts_with("127.") ||
           std::ranges::any_of(seen_, [&](const std::string& one) { return is_of(one, wanted); });
  });
  const auto added =
      std::ranges::find_if(seen_, [this](const std::string& one) { return !used_.contains(one); });
  return complete && added != seen_.end() ? *added : std::string();
}

}  // namespace linegate::dds
