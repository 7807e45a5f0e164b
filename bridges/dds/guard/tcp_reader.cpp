// SPDX-License-Identifier: Apache-2.0
#include "bridges/dds/guard/tcp_reader.h"

#include <cerrno>
#include <cstdint>

#include <sys/socket.h>

namespace linegate::dds::guard {
namespace {

bool may_continue(int error) {
  return error == EAGAIN || error == EWOULDBLOCK || error == EINTR;
}

// The cookie of a socket is unique until the host is started again (Linux, SO_COOKIE).
std::uint64_t cookie_of(int socket) {
  std::uint64_t cookie = 0;
  socklen_t size = sizeof cookie;
  if (::getsockopt(socket, SOL_SOCKET, SO_COOKIE, &cookie, &size) != 0)
    return 0;  // no socket
  return cookie;
}

// The library reads once more from a connection that ended within a message.
bool is_open(int socket, TcpReader::Receive receive) {
  char octet = 0;
  const ssize_t next = receive(socket, &octet, sizeof octet, MSG_PEEK | MSG_DONTWAIT);
  return next > 0 || (next < 0 && may_continue(errno));
}

}  // namespace

TcpReader::Result TcpReader::receive(int socket, void* buffer, std::size_t size, int flags,
                                     Receive below) {
  const std::uint64_t cookie = cookie_of(socket);
  if (ended_ || (connection_ && cookie != *connection_)) {
    ended_ = true;
    return {0, is_open(socket, below) ? Event::shared : Event::none};
  }
  const ssize_t received = below(socket, buffer, size, flags);
  if (received <= 0) {
    ended_ = size != 0 && (received == 0 || !may_continue(errno));
    return {received, Event::none};
  }
  const bool first = !connection_;
  connection_ = cookie;
  const Octets octets(static_cast<const std::uint8_t*>(buffer), static_cast<std::size_t>(received));
  if (stream_.take(octets))
    return {received, first ? Event::begun : Event::none};
  ended_ = true;
  ::shutdown(socket, SHUT_RDWR);
  return {0, Event::malformed};
}

}  // namespace linegate::dds::guard
