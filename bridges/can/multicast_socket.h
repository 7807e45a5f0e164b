// SPDX-License-Identifier: Apache-2.0
// Datagrams of a multicast group, in batches, in storage that is allocated once.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>

#include "bridges/can/udp.h"

namespace linegate::can_bridge {

class MulticastSocket {
 public:
  static constexpr std::size_t kBatch = 64;

  struct Received {
    std::span<const char> datagram;
    bool cut_short = false;  // it was longer
    bool own = false;        // sent by this very socket
    std::int64_t stamp_ns = 0;
    std::uint32_t dropped = 0;  // datagrams lost so far; only with has_dropped
    bool has_dropped = false;
  };

  MulticastSocket();
  ~MulticastSocket();
  MulticastSocket(const MulticastSocket&) = delete;
  MulticastSocket& operator=(const MulticastSocket&) = delete;

  // Closes an open socket first. Returns 0 or errno.
  int open(const UdpOptions& options);
  void close();
  // The descriptor that becomes readable; -1 while closed.
  int descriptor() const { return receiving_; }

  // Reads up to count (at most kBatch) datagrams without blocking. Returns their number, or -errno.
  // They stay valid until the next call.
  int receive(std::size_t count);
  Received received(std::size_t index) const;

  // Does not block. Returns 0 or errno.
  int send(std::span<const char> datagram);

 private:
  struct Buffers;

  int receiving_ = -1;
  int sending_ = -1;  // has its own port, which identifies own datagrams
  std::unique_ptr<Buffers> buffers_;
};

}  // namespace linegate::can_bridge
