// SPDX-License-Identifier: Apache-2.0
// Sends announcements of a participant without endpoints to hosts by unicast, and records which
// ports answer. The participant exists as long as this object: its end is announced, too.
#pragma once

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "bridges/dds/observed.h"
#include "gateway/doctor/observations.h"
#include "gateway/doctor/socket.h"

namespace linegate::doctor {

class Prober {
 public:
  explicit Prober(std::uint32_t domain);
  ~Prober();
  Prober(const Prober&) = delete;
  Prober& operator=(const Prober&) = delete;

  // A host by name or address: an argument, with the ports of the first participants of the domain,
  // or one of the profile, with `port` alone.
  void add_host(const std::string& name, std::uint16_t port = 0);
  // A place that a participant announced, in a datagram of the host `from`. A bounded number of
  // hosts and ports; none of multicast, and none of loopback but from there.
  void add_place(const dds::UdpLocator& place, const std::string& from);
  // Participants of this program, whose answers are none.
  void ignore(std::vector<dds::ObservedPrefix> own) { own_ = std::move(own); }

  // Sends what is due, and takes answers. now: since the start of the observation.
  void poll(Duration now);

  std::vector<ProbedHost> results() const;
  const dds::ObservedPrefix& prefix() const { return prefix_; }

 private:
  struct Port {
    ProbedPort result;
    UdpSocket socket{};
    int connect_error = 0;
  };
  struct Host {
    ProbedHost result;  // without its ports
    std::vector<Port> ports;
    std::vector<Port> closed;  // one, or none for an unknown name
  };

  Host& host_of(const std::string& name, const std::string& address);
  static void add_port(std::vector<Port>& ports, const std::string& address, std::uint16_t port);
  void send(Port& port, bool leaving);
  static void take_error(Port& port, int error);
  void take_answers();

  const std::uint32_t domain_;
  const dds::ObservedPrefix prefix_;
  UdpSocket answers_;
  std::vector<Host> hosts_;
  std::vector<dds::ObservedPrefix> own_;
  std::size_t announced_ = 0;  // ports
  Duration next_{};
};

}  // namespace linegate::doctor
