// SPDX-License-Identifier: Apache-2.0
// A UDP socket over IPv4 that is closed with its object. Never blocks.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace linegate::doctor {

struct Datagram {
  std::string from;  // address
  std::vector<std::uint8_t> octets;
};

class UdpSocket {
 public:
  UdpSocket();  // open() is false if the system has no descriptor
  ~UdpSocket();
  UdpSocket(UdpSocket&& other) noexcept : descriptor_(std::exchange(other.descriptor_, -1)) {}
  UdpSocket& operator=(UdpSocket&&) = delete;

  bool open() const { return descriptor_ >= 0; }
  int descriptor() const { return descriptor_; }

  // Each returns 0 or the errno of the system.
  int bind(const std::string& address, std::uint16_t port, bool shared);
  int connect(const std::string& address, std::uint16_t port);
  int join(const std::string& group, unsigned interface);
  int send_on(unsigned interface, const std::string& group, std::uint16_t port,
              std::span<const std::uint8_t> octets);
  int send(std::span<const std::uint8_t> octets);  // after connect()
  // The error that the network reported for an earlier datagram (ICMP); 0 = none.
  int pop_error();

  // Nothing if no datagram waits.
  std::optional<Datagram> receive();
  // Of this end.
  std::string address() const;
  std::uint16_t port() const;

 private:
  int descriptor_;
};

}  // namespace linegate::doctor
