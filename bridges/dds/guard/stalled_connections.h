// SPDX-License-Identifier: Apache-2.0
// TCP connections whose peer reads nothing any more.
//
// Fast DDS 2.9.1 sends with a call that blocks until the peer has taken the data, while it holds
// the locks of the writer: one peer that stops reading keeps every other one from being served, and
// two that send to each other at the same time may both stop for ever. So the system ends a
// connection on which sent data was not taken for kStalled; Fast DDS opens it again.
#pragma once

#include <chrono>
#include <cstddef>

namespace linegate::dds::guard {

inline constexpr std::chrono::milliseconds kStalled{2000};

// Applies the limit to that TCP socket; connections that a listening socket accepts inherit it.
// Returns false if the descriptor is not a TCP socket.
bool limit_stalls(int socket);
// Applies the limit to every listening TCP socket of this process. Returns their number.
std::size_t limit_stalls_of_listeners();

}  // namespace linegate::dds::guard
