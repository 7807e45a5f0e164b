// SPDX-License-Identifier: Apache-2.0
// Receives the announcements of participants of all domains by multicast. Sends nothing.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "gateway/doctor/observations.h"
#include "gateway/doctor/socket.h"

namespace linegate::doctor {

class Listener {
 public:
  static constexpr std::size_t kMostHeard = 1024;  // any host can invent participants

  // On all interfaces that are up, in the domains 0 to 232.
  explicit Listener(const std::vector<Interface>& interfaces);

  // Takes the datagrams that wait. now: since the start of the observation.
  void poll(Duration now);
  // Takes one datagram, as if it arrived in that domain. For tests, too.
  void take(std::uint32_t domain, const Datagram& datagram, Duration now);

  const std::vector<Heard>& heard() const { return heard_; }

 private:
  std::vector<std::pair<std::uint32_t, UdpSocket>> sockets_;  // by domain
  std::vector<Heard> heard_;
};

}  // namespace linegate::doctor
