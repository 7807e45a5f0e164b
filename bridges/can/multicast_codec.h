// SPDX-License-Identifier: Apache-2.0
// CAN frames in the format of python-can's interface udp_multicast: one MessagePack map in each
// datagram.
//
//   timestamp              float, UTC in seconds; the receiver stamps received frames itself
//   arbitration_id         integer
//   is_extended_id, is_remote_frame, is_error_frame, is_fd, bitrate_switch, error_state_indicator
//                          boolean
//   channel                nil, or the sender's name of its interface
//   dlc                    integer: number of data bytes, also of FD frames; the requested
//                          number in a remote frame
//   data                   binary
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>

#include <linux/can.h>

#include "stack/can/frame.h"

namespace linegate::can_bridge {

// More than any of these datagrams has.
inline constexpr std::size_t kMulticastDatagram = 512;

// Gives the length. stamp_ns: UTC, ns since 1970.
std::size_t encode_multicast(const can::Frame& frame, std::int64_t stamp_ns,
                             std::span<char, kMulticastDatagram> out);

class MulticastDecoder {
 public:
  MulticastDecoder();
  ~MulticastDecoder();
  MulticastDecoder(const MulticastDecoder&) = delete;
  MulticastDecoder& operator=(const MulticastDecoder&) = delete;

  enum class Result : std::uint8_t { frame, error_frame, malformed };
  // Fills frame but for its time; or error, for ErrorDecoder. Keys it does not know are left out.
  // Does not allocate once it has seen a few, whatever lengths a datagram claims to have.
  // Precondition: at most kMulticastDatagram bytes.
  Result decode(std::span<const char> datagram, can::Frame& frame, canfd_frame& error);

 private:
  struct Parser;
  std::unique_ptr<Parser> parser_;
};

}  // namespace linegate::can_bridge
