// SPDX-License-Identifier: Apache-2.0
// Whether the host has an address that a participant would use, and does not, because the host did
// not have it when the participant was created.
//
// Fast DDS 2.9.1 looks at the interfaces when a participant is created, and takes the IPv4
// addresses of those that are up and have a carrier (IFF_RUNNING; upstream issues 664, 1880, 4371).
// Without this, a program that starts before its switch or its DHCP server does would never reach
// another host.
#pragma once

#include <functional>
#include <set>
#include <string>
#include <utility>
#include <vector>

namespace linegate::dds {

// "eth0 192.168.7.20": the addresses of the host that a participant would use, with their
// interfaces, but those of loopback.
std::set<std::string> usable_addresses();

// From one thread at a time.
class AddressWatch {
 public:
  using Addresses = std::set<std::string>;

  // Looks for the first time: call it before the participant is created. interfaces: names or
  // addresses; empty: all count. host: returns the addresses of the host.
  explicit AddressWatch(std::vector<std::string> interfaces = {},
                        std::function<Addresses()> host = usable_addresses)
      : interfaces_(std::move(interfaces)), host_(std::move(host)) {
    look();
  }

  // Looks.
  void look();
  // Looks, after a participant was created since the last look: it uses the addresses of both.
  void created();
  // Looks, while the participant is perhaps still being created: it does not use those that went.
  void narrow();

  // Looks. Returns an address that the participant does not use; empty: there is none, or one of
  // the interfaces has no address, so that another participant could not be created.
  // One that went and came back is not new: the participant still has it.
  std::string added();

 private:
  Addresses present() const;

  const std::vector<std::string> interfaces_;
  const std::function<Addresses()> host_;
  Addresses used_;
  Addresses seen_;  // by the last look
};

}  // namespace linegate::dds
