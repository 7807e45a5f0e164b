// SPDX-License-Identifier: Apache-2.0
// Lies between the TCP sockets of this process and Fast DDS 2.9.1, which gives no access to them:
// its calls of recv(2) come here.
#pragma once

#include <cstddef>
#include <memory>

#include "bridges/dds/guard/guard.h"
#include "bridges/dds/guard/lost_peers.h"

namespace linegate::dds::guard {

struct TcpTransport {
  std::size_t largest = 0;  // maxMessageSize, in octets
  bool tls = false;
};

// Checks all TCP connections of this process from now on, and limits how long they may stall, see
// tcp_reader.h and stalled_connections.h. If a transport has TLS, no connection of the process is
// checked: the library reads those in other threads. guard: counts the connections that are ended,
// as long as it exists. Returns false if the calls of the loaded library cannot be replaced.
bool check_tcp_input(const TcpTransport& transport, const std::shared_ptr<Guard>& guard);

// The accepted TCP connection of which Fast DDS processes a datagram in the calling thread; 0:
// none.
LostPeers::Connection receiving_connection();
// Whether that connection was lost, or closed. From any thread.
bool has_ended(LostPeers::Connection which);

// Exists while Fast DDS opens a channel.
//
// Fast DDS 2.9.1 connects, or asks for a logical port, first and records the port afterwards. If it
// processes the response to this request in between, it ignores it (RTCPMessageManager.cpp,
// BIND_CONNECTION_RESPONSE: no port is pending; TCPChannelResource::add_logical_port()), and never
// sends anything to that port: about one of 30 clients never received anything. So no received
// octets are passed on while a channel is opened, for kOpening at most.
class OpeningChannel {
 public:
  OpeningChannel();
  ~OpeningChannel();
  OpeningChannel(const OpeningChannel&) = delete;
  OpeningChannel& operator=(const OpeningChannel&) = delete;
};

// Whether a channel is opened now. Its thread may wait for a receiving thread.
bool is_opening_channel();

}  // namespace linegate::dds::guard
