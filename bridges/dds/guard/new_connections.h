// SPDX-License-Identifier: Apache-2.0
// The TCP connections that a call of Fast DDS opened.
//
// Fast DDS 2.9.1 connects first and records the logical port afterwards. If the response to its
// bind request arrives in between, it is ignored (RTCPMessageManager.cpp, BIND_CONNECTION_RESPONSE:
// no port is pending), and nothing is ever sent on that connection: about one of 30 clients never
// received anything. A connection that is lost is opened again with the next datagram, when the
// port is recorded.
#pragma once

#include <cstddef>
#include <set>

#include <netinet/in.h>

namespace linegate::dds::guard {

class NewConnections {
 public:
  // Records the existing connections of this process to that address.
  explicit NewConnections(const sockaddr_in& to);

  // Shuts down the connections that were opened since and have already received octets. Returns
  // their number. Call it immediately after the call that may have opened one.
  std::size_t end_answered() const;
  // Limits how long the connections opened since may stall, see stalled_connections.h.
  void limit_stalls() const;

 private:
  const sockaddr_in to_;
  std::set<int> before_;
};

}  // namespace linegate::dds::guard
