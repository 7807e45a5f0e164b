// SPDX-License-Identifier: Apache-2.0
// Follows the octets of a TCP connection of Fast DDS 2.9.1: RTCP messages one after the other
// (RTCPHeader.h, TCPControlMessage.cpp there). All numbers are in the octet order of the host, as
// the library reads them.
//
//   0  "RTCP"   4  length including these 14 octets   8  CRC   12  logical port   14  body
//
// The body is an RTPS datagram, or with logical port 0 a control message:
//
//   0  kind   1  flags   2  length of the body   4  transaction   16  code of a response (4
//   octets), then, if the kind has a content: encapsulation (2 octets), length (4 octets), that
//   content
//
// The library reads and copies what these lengths claim. A message that is longer than its buffer
// makes it skip up to 4 GiB of that connection and of the next one, or loop for ever if the
// connection ends before.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "bridges/dds/guard/wire.h"

namespace linegate::dds::guard {

class RtcpStream {
 public:
  // largest: octets of the largest body, maxMessageSize of the transport.
  explicit RtcpStream(std::size_t largest) : largest_(largest) {}

  // The next octets of the connection. Returns false from the first one on that no well-formed
  // message contains; nothing from there on may reach the library. Does not allocate.
  bool take(Octets octets);
  // Whether the peer opened the connection: its first message is a bind request.
  bool is_accepted() const { return accepted_; }

 private:
  static constexpr std::size_t kHeader = 14;
  static constexpr std::size_t kControl = 34;  // the longest part of a control message with a check

  void keep(Octets& octets);
  void check();
  void check_header();
  bool control_is_valid() const;
  Wire kept() const;

  std::size_t largest_;
  bool valid_ = true;
  bool first_ = true;  // no message was checked yet
  bool accepted_ = false;
  std::array<std::uint8_t, kHeader + kControl> kept_{};  // the begin of the message
  std::size_t size_ = 0;                                 // of kept_
  std::size_t wanted_ = kHeader;                         // before the next check
  std::size_t body_ = 0;                                 // of the message
  std::size_t rest_ = 0;                                 // its octets that are not checked
};

}  // namespace linegate::dds::guard
