// SPDX-License-Identifier: Apache-2.0
// What one receiving thread of Fast DDS reads from its TCP connection.
//
// Fast DDS 2.9.1 makes a receiving thread for each connection. When one has been lost, its thread
// marks the channel as disconnected (TCPChannelResourceBasic::disconnect) and then checks that mark
// to end (perform_listen_operation). If another thread sends in between, it opens the connection
// again, and the old thread, which finds the channel connected, reads from the new connection as
// well. Then each of two threads gets a part of the messages, both lose their position in them, and
// the channel receives nothing for ever. So here a thread that has lost its connection finds every
// other one ended: the library closes it, and opens it again with the next datagram.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>

#include <sys/types.h>

#include "bridges/dds/guard/rtcp_stream.h"

namespace linegate::dds::guard {

class TcpReader {
 public:
  using Receive = ssize_t (*)(int socket, void* buffer, std::size_t size, int flags);  // recv(2)

  enum class Event {
    none,
    begun,      // the first octets of the connection were received
    malformed,  // they are no RTCP messages: the connection was ended
    shared,     // another thread reads from this connection: the result says that it has ended
  };
  struct Result {
    ssize_t received = 0;  // as of recv(2), which sets errno
    Event event = Event::none;
  };

  // largest: see RtcpStream.
  explicit TcpReader(std::size_t largest) : stream_(largest) {}

  // Receives by `below`, and ends the connection if its octets are no RTCP messages.
  Result receive(int socket, void* buffer, std::size_t size, int flags, Receive below);
  bool is_accepted() const { return stream_.is_accepted(); }
  bool has_ended() const { return ended_; }

 private:
  RtcpStream stream_;
  // The cookie of its connection, because the descriptor of a closed one is used again; nothing: no
  // octets received yet.
  std::optional<std::uint64_t> connection_;
  bool ended_ = false;  // that connection
};

}  // namespace linegate::dds::guard
