// SPDX-License-Identifier: Apache-2.0
// When DDS must start again, because the host got an address that it was started without.
//
// Fast DDS 2.9.1 looks at the interfaces when a participant is created, and takes only those with a
// carrier (upstream issues 664, 1880, 4371). Without this, a gateway that starts before its switch
// or its DHCP server does would never be seen by other hosts.
#pragma once

#include <functional>
#include <set>
#include <string>
#include <vector>

#include "stack/base/time.h"

namespace linegate::gateway {

// From one thread at a time.
class AddressChange {
 public:
  // Between two looks at the addresses.
  static constexpr Duration kLook = std::chrono::seconds(1);
  // Between two starts for that reason.
  static constexpr Duration kPause = std::chrono::seconds(5);

  // "eth0 192.168.7.20": the addresses that a participant would use now, with their interfaces.
  using Addresses = std::set<std::string>;

  // Call it before the participant is created. interfaces: names or addresses, of which at least
  // one must match; empty: all addresses count. addresses: returns those of the host.
  AddressChange(std::vector<std::string> interfaces, std::function<Addresses()> addresses);

  // Why DDS is to be started again; empty: it is not.
  std::string due(Instant now);
  // It is, for this reason or another one. Call it before the participant is created.
  void done(Instant now);

 private:
  Addresses look() const;

  const std::vector<std::string> interfaces_;
  const std::function<Addresses()> addresses_;
  Addresses used_;
  Instant look_at_{};
  Instant not_before_{};
};

}  // namespace linegate::gateway
