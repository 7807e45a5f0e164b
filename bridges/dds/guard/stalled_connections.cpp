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

}  // namespace linegate::dds::guard
