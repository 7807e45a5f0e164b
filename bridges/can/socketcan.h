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
  std::size_t queue_depth = 8;  // own frames in the kernel's queue at most, 1..16
  Duration retry_period = std::chrono::milliseconds(500);  // between attempts to open
  int receive_buffer = 1 << 20;  // bytes asked from the kernel (SO_RCVBUF); it may grant less
  // Of an interface that is found down, if it is not empty. Without the permission (CAP_NET_ADMIN)
  // that is reported as an interface that is down.
  ControllerSetup setup;
};

struct ParsedSetup {
  ControllerSetup setup;
  std::string error;  // empty, or a sentence for the integrator
};
ParsedSetup controller_setup(const InterfaceUri& uri);

// Never fails: an interface that cannot be opened is reported by the first read(), and tried again
// every retry_period. interface: 1 to 15 characters.
std::unique_ptr<Channel> open_socketcan(std::string_view interface, const SocketOptions& options);

// The same on a descriptor that is open already and carries struct can_frame or canfd_frame in each
// datagram: a socket somebody else has configured, or an end of a socketpair() where the kernel has
// no CAN. Takes ownership. There are no echoes then: back-pressure is what the socket says (EAGAIN,
// ENOBUFS). When the other end is gone, the channel fails once and for all.
std::unique_ptr<Channel> open_on_descriptor(int descriptor);

}  // namespace linegate::can_bridge
