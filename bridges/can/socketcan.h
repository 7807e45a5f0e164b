// SPDX-License-Identifier: Apache-2.0
// The channel "socketcan:NAME": a CAN_RAW socket on one interface of the Linux kernel.
//
//   socketcan:can0
//   socketcan:can0?bitrate=500000&sample-point=0.875&restart-ms=100
//   socketcan:can0?bitrate=500000&dbitrate=2000000&dsample-point=0.75    CAN FD
//   socketcan:can0?bitrate=500000&listen-only=on
//
// The options are named as those of `ip link set can0 type can`. With any of them an interface that
// is down is set up; one that is up is left as it is.
//
// Receives in batches with the kernel's time stamps, hears error frames, and keeps only a few own
// frames in the kernel's queue, counted by their own echoes, because that queue knows no priority.
#pragma once

#include <memory>
#include <string>
#include <string_view>

#include "bridges/can/channel.h"
#include "bridges/can/controller_setup.h"
#include "bridges/can/interface_uri.h"

namespace linegate::can_bridge {

struct SocketOptions {
  std::size_t queue_depth = 8;  // largest number of own frames in the kernel's queue, 1..16
  Duration retry_period = std::chrono::milliseconds(500);  // between attempts to open
  int receive_buffer = 1 << 20;  // bytes requested with SO_RCVBUF; the kernel may grant less
  // If not empty: the configuration of an interface that is found down. Without CAP_NET_ADMIN the
  // interface is reported as down.
  ControllerSetup setup;
};

struct ParsedSetup {
  ControllerSetup setup;
  std::string error;  // empty, or an error message
};
ParsedSetup controller_setup(const InterfaceUri& uri);

// Never fails: the first read() reports an interface that cannot be opened, and opening is retried
// every retry_period. interface: 1 to 15 characters.
std::unique_ptr<Channel> open_socketcan(std::string_view interface, const SocketOptions& options);

// The same for an open descriptor that carries one struct can_frame or canfd_frame in each
// datagram: a socket that was configured elsewhere, or one end of a socketpair() on a kernel
// without CAN. Takes ownership. There are no echoes; back-pressure is reported by the socket
// (EAGAIN, ENOBUFS). When the peer closes, the channel fails permanently.
std::unique_ptr<Channel> open_on_descriptor(int descriptor);

}  // namespace linegate::can_bridge
