// SPDX-License-Identifier: Apache-2.0
// Connections over TCP that a call of Fast DDS opened.
//
// Fast DDS 2.9.1 connects first and notes the logical port afterwards. If the response to its bind
// request comes in between, it is ignored (RTCPMessageManager.cpp, BIND_CONNECTION_RESPONSE: no
// port is pending), and nothing is ever sent on that connection: about one of 30 clients received
// nothing for ever. A connection that is lost is opened again at the next datagram, the port noted.
#pragma once

#include <cstddef>
#include <set>

#include <netinet/in.h>

namespace linegate::dds::guard {

class NewConnections {
 public:
  // Remembers which connections of this process to that address there are.
  explicit NewConnections(const sockaddr_in& to);

  // Ends those that came since and have received octets already. Gives how many. To be called at
  // once behind the call that may have opened one.
  std::size_t end_answered() const;

 private:
  const sockaddr_in to_;
  std::set<int> before_;
};

}  // namespace linegate::dds::guard
