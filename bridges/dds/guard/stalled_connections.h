// SPDX-License-Identifier: Apache-2.0
// TCP connections whose peer reads nothing any more.
//
// Fast DDS 2.9.1 sends with a call that blocks until the peer has taken the data, while it holds
// the locks of the writer: one peer that stops reading keeps every other one from being served, and
// two that send to each other at the same time may both stop for ever. So the system ends a
// connection on which sent data was not taken for kStalled; Fast DDS opens it again.
//
// The price of a short limit: a connection that an interrupted network keeps from its peer for that
// long is ended, too.
#pragma once

#include <chrono>
#include <cstddef>
#include <optional>

namespace linegate::dds::guard {

inline constexpr std::chrono::milliseconds kStalled{750};
// A call that blocks ends so much later at most: Linux counts from its first probe of a peer
// without room, which it sends after the retransmission time-out (at least 200 ms), and rounds up.
inline constexpr std::chrono::milliseconds kStalledLater{500};

// Applies the limit to that TCP socket; connections that a listening socket accepts inherit it.
// Returns false if the descriptor is not a TCP socket.
bool limit_stalls(int socket);
// Applies the limit to every listening TCP socket of this process. Returns their number.
std::size_t limit_stalls_of_listeners();
// Applies the limit to every TCP socket of this process that has none: connections that Fast DDS
// opened, or opened again. Returns their number.
std::size_t limit_stalls_of_all();

// Repeats limit_stalls_of_all(), because Fast DDS opens a lost connection again without notice. One
// thread; it is not the one that sends, which a stalled connection blocks. The limit also ends a
// call that already blocks.
class StallLimits {
 public:
  static constexpr std::chrono::milliseconds kPeriod{500};

  // now: of any steady clock. Does nothing if the last repetition is less than kPeriod ago. Returns
  // the number of sockets that had no limit.
  std::size_t advance(std::chrono::nanoseconds now);

 private:
  std::optional<std::chrono::nanoseconds> next_;
};

}  // namespace linegate::dds::guard
