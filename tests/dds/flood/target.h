// SPDX-License-Identifier: Apache-2.0
// The sockets of the receiving participants, from /proc/net/udp.
#pragma once

#include <cstdint>
#include <map>

namespace linegate::flood {

struct Queue {
  std::uint64_t waiting = 0;  // octets that were not received yet
  std::uint64_t dropped = 0;  // datagrams dropped because the queue was full
};

// The UDP sockets of this network namespace that are bound to a port of the domain.
std::map<std::uint16_t, Queue> queues(std::uint32_t domain);

}  // namespace linegate::flood
