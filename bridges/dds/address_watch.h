// SPDX-License-Identifier: Apache-2.0
// Whether the host has got an address that a participant uses, and that it did not have before.
// Fast DDS 2.9.1 takes the IPv4 addresses of the interfaces that are up and have a carrier
// (IFF_RUNNING) when a participant is created.
#pragma once

#include <set>
#include <string>
#include <utility>

namespace linegate::dds {

// "eth0 192.168.7.20": those addresses, with their interfaces.
std::set<std::string> usable_addresses();

class AddressWatch {
 public:
  // Begins with the addresses of now.
  AddressWatch() : AddressWatch(usable_addresses()) {}
  explicit AddressWatch(std::set<std::string> known) : known_(std::move(known)) {}

  // An address of `now` is new. One that went and came back is not: the participant still has it.
  bool has_new(const std::set<std::string>& now = usable_addresses()) const;

 private:
  std::set<std::string> known_;
};

}  // namespace linegate::dds
