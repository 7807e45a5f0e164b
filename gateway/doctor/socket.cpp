// SPDX-License-Identifier: Apache-2.0
#include "gateway/doctor/socket.h"

#include <array>
#include <cerrno>

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

namespace linegate::doctor {
namespace {

sockaddr_in socket_address(const std::string& address, std::uint16_t port) {
  sockaddr_in out{};
  out.sin_family = AF_INET;
  out.sin_port = htons(port);
  ::inet_pton(AF_INET, address.c_str(), &out.sin_addr);
  return out;
}

int error_of(ssize_t result) {
  return result < 0 ? errno : 0;
}

std::string text_of(const sockaddr_in& it) {
  std::array<char, INET_ADDRSTRLEN> out{};
  ::inet_ntop(AF_INET, &it.sin_addr, out.data(), out.size());
  return out.data();
}

sockaddr_in own_end(int descriptor) {
  sockaddr_in out{};
  socklen_t size = sizeof out;
  ::getsockname(descriptor, reinterpret_cast<sockaddr*>(&out), &size);
  return out;
}

}  // namespace

UdpSocket::UdpSocket()
    : descriptor_(::socket(AF_INET, SOCK_DGRAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0)) {
}

UdpSocket::~UdpSocket() {
  if (descriptor_ >= 0)
    ::close(descriptor_);
}

int UdpSocket::bind(const std::string& address, std::uint16_t port, bool shared) {
  const int on = 1;
  const int off = 0;
  if (shared) {
    ::setsockopt(descriptor_, SOL_SOCKET, SO_REUSEADDR, &on, sizeof on);
    // Without it a socket receives the groups of every other socket, too.
    ::setsockopt(descriptor_, IPPROTO_IP, IP_MULTICAST_ALL, &off, sizeof off);
  }
  const sockaddr_in to = socket_address(address, port);
  return error_of(::bind(descriptor_, reinterpret_cast<const sockaddr*>(&to), sizeof to));
}

int UdpSocket::connect(const std::string& address, std::uint16_t port) {
  const sockaddr_in to = socket_address(address, port);
  return error_of(::connect(descriptor_, reinterpret_cast<const sockaddr*>(&to), sizeof to));
}

int UdpSocket::join(const std::string& group, unsigned interface) {
  ip_mreqn request{};
  ::inet_pton(AF_INET, group.c_str(), &request.imr_multiaddr);
  request.imr_ifindex = static_cast<int>(interface);
  return error_of(
      ::setsockopt(descriptor_, IPPROTO_IP, IP_ADD_MEMBERSHIP, &request, sizeof request));
}

int UdpSocket::send_on(unsigned interface, const std::string& group, std::uint16_t port,
                       std::span<const std::uint8_t> octets) {
  ip_mreqn request{};
  request.imr_ifindex = static_cast<int>(interface);
  if (::setsockopt(descriptor_, IPPROTO_IP, IP_MULTICAST_IF, &request, sizeof request) < 0)
    return errno;
  const sockaddr_in to = socket_address(group, port);
  return error_of(::sendto(descriptor_, octets.data(), octets.size(), 0,
                           reinterpret_cast<const sockaddr*>(&to), sizeof to));
}

int UdpSocket::send(std::span<const std::uint8_t> octets) {
  return error_of(::send(descriptor_, octets.data(), octets.size(), 0));
}

int UdpSocket::pop_error() {
  int out = 0;
  socklen_t size = sizeof out;
  ::getsockopt(descriptor_, SOL_SOCKET, SO_ERROR, &out, &size);
  return out;
}

std::optional<Datagram> UdpSocket::receive() {
  std::array<std::uint8_t, 65'536> octets;
  sockaddr_in from{};
  socklen_t size = sizeof from;
  const ssize_t got = ::recvfrom(descriptor_, octets.data(), octets.size(), 0,
                                 reinterpret_cast<sockaddr*>(&from), &size);
  if (got < 0)
    return std::nullopt;
  return Datagram{text_of(from), {octets.begin(), octets.begin() + got}};
}

std::string UdpSocket::address() const {
  return text_of(own_end(descriptor_));
}

std::uint16_t UdpSocket::port() const {
  return ntohs(own_end(descriptor_).sin_port);
}

}  // namespace linegate::doctor
