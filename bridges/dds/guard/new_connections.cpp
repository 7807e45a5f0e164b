// SPDX-License-Identifier: Apache-2.0
#include "bridges/dds/guard/new_connections.h"

#include <fcntl.h>
#include <linux/tcp.h>
#include <sys/socket.h>
#include <unistd.h>

#include "bridges/dds/guard/descriptors.h"
#include "bridges/dds/guard/stalled_connections.h"

namespace linegate::dds::guard {
namespace {

bool leads_to(int socket, const sockaddr_in& to) {
  sockaddr_in peer{};
  socklen_t size = sizeof peer;
  return ::getpeername(socket, reinterpret_cast<sockaddr*>(&peer), &size) == 0 &&
         peer.sin_family == AF_INET && peer.sin_port == to.sin_port &&
         peer.sin_addr.s_addr == to.sin_addr.s_addr;
}

bool has_received(int socket) {
  tcp_info info{};
  socklen_t size = sizeof info;
  return ::getsockopt(socket, IPPROTO_TCP, TCP_INFO, &info, &size) == 0 &&
         info.tcpi_bytes_received != 0;
}

// Includes connections that are being established: they have a peer's address once the peer has
// answered.
template <class Each>
void each_connection(const sockaddr_in& to, Each each) {
  each_descriptor([&](int descriptor) {
    if (leads_to(descriptor, to))
      each(descriptor);
  });
}

}  // namespace

NewConnections::NewConnections(const sockaddr_in& to) : to_(to) {
  each_connection(to_, [&](int descriptor) { before_.insert(descriptor); });
}

void NewConnections::limit_stalls() const {
  each_connection(to_, [&](int descriptor) {
    if (!before_.contains(descriptor))
      guard::limit_stalls(descriptor);
  });
}

std::size_t NewConnections::end_answered() const {
  std::size_t ended = 0;
  each_connection(to_, [&](int descriptor) {
    if (before_.contains(descriptor))
      return;
    // Another thread may close the descriptor and open a file with the same number: check a
    // duplicate.
    const int copy = ::fcntl(descriptor, F_DUPFD_CLOEXEC, 0);
    if (copy < 0)
      return;
    if (leads_to(copy, to_) && has_received(copy) && ::shutdown(copy, SHUT_RDWR) == 0)
      ++ended;
    ::close(copy);
  });
  return ended;
}

}  // namespace linegate::dds::guard
