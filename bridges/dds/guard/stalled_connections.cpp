// SPDX-License-Identifier: Apache-2.0
#include "bridges/dds/guard/stalled_connections.h"

#include <linux/tcp.h>
#include <netinet/in.h>
#include <sys/socket.h>

#include "bridges/dds/guard/descriptors.h"

namespace linegate::dds::guard {

bool limit_stalls(int socket) {
  constexpr auto kLimit = static_cast<unsigned>(kStalled.count());
  return ::setsockopt(socket, IPPROTO_TCP, TCP_USER_TIMEOUT, &kLimit, sizeof kLimit) == 0;
}

std::size_t limit_stalls_of_listeners() {
  std::size_t limited = 0;
  each_descriptor([&](int descriptor) {
    int listens = 0;
    socklen_t size = sizeof listens;
    if (::getsockopt(descriptor, SOL_SOCKET, SO_ACCEPTCONN, &listens, &size) == 0 && listens != 0 &&
        limit_stalls(descriptor))
      ++limited;
  });
  return limited;
}

std::size_t limit_stalls_of_all() {
  std::size_t limited = 0;
  each_descriptor([&](int descriptor) {
    int protocol = 0;
    socklen_t size = sizeof protocol;
    if (::getsockopt(descriptor, SOL_SOCKET, SO_PROTOCOL, &protocol, &size) != 0 ||
        protocol != IPPROTO_TCP)
      return;
    unsigned limit = 0;
    size = sizeof limit;
    if (::getsockopt(descriptor, IPPROTO_TCP, TCP_USER_TIMEOUT, &limit, &size) == 0 && limit == 0 &&
        limit_stalls(descriptor))
      ++limited;
  });
  return limited;
}

std::size_t StallLimits::advance(std::chrono::nanoseconds now) {
  if (next_ && now < *next_)
    return 0;
  next_ = now + kPeriod;
  return limit_stalls_of_all();
}

}  // namespace linegate::dds::guard
