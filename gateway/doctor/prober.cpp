// SPDX-License-Identifier: Apache-2.0
#include "gateway/doctor/prober.h"

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <random>

#include "bridges/dds/announcement.h"
#include "bridges/dds/network_choice.h"

namespace linegate::doctor {
namespace {

constexpr Duration kAgain = std::chrono::milliseconds(700);
constexpr std::uint32_t kLease = 3;         // s
constexpr std::uint32_t kParticipants = 4;  // of a host; the library announces itself to as many
// Of discovery, of a participant that a host hardly has.
constexpr std::uint32_t kUnusedParticipant = 118;
constexpr std::size_t kMostHosts = 64;
// Announcements are foreign: they name the hosts and ports, and each one costs a socket here and a
// datagram there.
constexpr std::size_t kMostAnnounced = 128;  // ports
constexpr std::size_t kMostAnnouncedOfHost = 16;

dds::ObservedPrefix random_prefix() {
  std::random_device random;
  dds::ObservedPrefix out{};
  for (std::uint8_t& octet : out)
    octet = static_cast<std::uint8_t>(random() & 0xFFU);
  out[0] &= 0x7F;  // not one of DDS-Security
  return out;
}

// Not of multicast or broadcast, and not of this host's loopback.
bool is_host(const std::string& address) {
  const int first = std::atoi(address.c_str());
  return first > 0 && first < 224 && first != 127;
}

bool has_place(const dds::Announcement& it, const std::string& address, std::uint16_t port) {
  return std::ranges::count(it.unicast, dds::UdpLocator{address, port}) != 0;
}

}  // namespace

Prober::Prober(std::uint32_t domain) : domain_(domain), prefix_(random_prefix()) {
  (void)answers_.bind("0.0.0.0", 0, false);
}

Prober::~Prober() {
  for (Host& host : hosts_) {
    for (Port& port : host.ports)
      send(port, true);
  }
}

Prober::Host& Prober::host_of(const std::string& name, const std::string& address) {
  const auto known = std::ranges::find_if(hosts_, [&](const Host& it) {
    return address.empty() ? it.result.name == name : it.result.address == address;
  });
  if (known != hosts_.end())
    return *known;
  Host& out = hosts_.emplace_back();
  out.result.name = name;
  out.result.address = address;
  if (!address.empty())
    add_port(out.closed, address, dds::unicast_port(domain_, kUnusedParticipant));
  return out;
}

void Prober::add_port(std::vector<Port>& ports, const std::string& address, std::uint16_t port) {
  const bool known =
      std::ranges::any_of(ports, [&](const Port& it) { return it.result.port == port; });
  if (known)
    return;
  Port added;
  added.result.port = port;
  added.connect_error = added.socket.connect(address, port);
  take_error(added, added.connect_error);
  ports.push_back(std::move(added));
}

void Prober::add_host(const std::string& name, std::uint16_t port) {
  if (hosts_.size() >= kMostHosts)
    return;
  Host& host = host_of(name, dds::address_of_host(name));
  host.result.given = true;
  host.result.named = host.result.named || port == 0;
  if (host.result.address.empty())
    return;
  if (port != 0)
    return add_port(host.ports, host.result.address, port);
  for (std::uint32_t i = 0; i < kParticipants; ++i)
    add_port(host.ports, host.result.address, dds::unicast_port(domain_, i));
}

void Prober::add_place(const dds::UdpLocator& place, const std::string& from) {
  const bool is_new = std::ranges::none_of(hosts_, [&](const Host& it) {
    return it.result.address == place.address &&
           std::ranges::count(it.ports, place.port,
                              [](const Port& port) { return port.result.port; }) != 0;
  });
  if (!is_new || (!is_host(place.address) && place.address != from) ||
      hosts_.size() >= kMostHosts || announced_ >= kMostAnnounced)
    return;
  Host& host = host_of(place.address, place.address);
  if (host.ports.size() >= kMostAnnouncedOfHost)
    return;
  ++announced_;
  add_port(host.ports, place.address, place.port);
}

void Prober::take_error(Port& port, int error) {
  if (error == 0 || error == EAGAIN || port.result.answer == PortAnswer::answered)
    return;
  port.result.answer = error == ECONNREFUSED ? PortAnswer::refused : PortAnswer::unreachable;
  port.result.error = std::strerror(error);
}

void Prober::send(Port& port, bool leaving) {
  if (port.connect_error != 0)
    return;
  dds::Announcement own{.prefix = prefix_, .leaving = leaving, .name = "linegate client doctor"};
  own.unicast.push_back({port.socket.address(), answers_.port()});
  take_error(port, port.socket.send(dds::write_announcement(own, kLease)));
}

void Prober::take_answers() {
  constexpr int kMostAnswers = 1024;  // in one poll
  for (int i = 0; i < kMostAnswers; ++i) {
    const auto datagram = answers_.receive();
    if (!datagram)
      return;
    const auto announcement = dds::read_announcement(datagram->octets);
    if (!announcement || std::ranges::count(own_, announcement->prefix) != 0)
      continue;
    for (Host& host : hosts_) {
      for (Port& port : host.ports) {
        if (!has_place(*announcement, host.result.address, port.result.port))
          continue;
        port.result.answer = PortAnswer::answered;
        port.result.program = announcement->name;
      }
    }
  }
}

void Prober::poll(Duration now) {
  take_answers();
  for (Host& host : hosts_) {
    for (auto* const ports : {&host.ports, &host.closed}) {
      for (Port& port : *ports)
        take_error(port, port.socket.pop_error());
    }
  }
  if (now < next_)
    return;
  next_ = now + kAgain;
  for (Host& host : hosts_) {
    for (auto* const ports : {&host.ports, &host.closed}) {
      for (Port& port : *ports)
        send(port, false);
    }
  }
}

std::vector<ProbedHost> Prober::results() const {
  std::vector<ProbedHost> out;
  for (const Host& host : hosts_) {
    ProbedHost& one = out.emplace_back(host.result);
    for (const Port& port : host.ports)
      one.ports.push_back(port.result);
    if (!host.closed.empty())
      one.closed = host.closed.front().result;
  }
  return out;
}

}  // namespace linegate::doctor
