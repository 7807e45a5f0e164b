// SPDX-License-Identifier: Apache-2.0
// Why a datagram is dropped, or a TCP connection ended.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>

namespace linegate::dds::guard {

enum class Reason : std::uint8_t {
  none,             // passed on
  header,           // no RTPS 2 header
  submessage,       // a length that exceeds the datagram, or a fixed part that is cut
  sequence_number,  // below 1, above 2^48, or a range that ends before it begins
  sequence_set,     // GAP, ACKNACK, NACK_FRAG: bitmap of more than 256 bits, or cut
  fragment,         // DATA_FRAG, HEARTBEAT_FRAG: fragments that do not make up the sample
  parameters,       // inline QoS
  discovery,        // a parameter of a discovery sample that claims more octets than it has
  statistics,       // Fast DDS statistics submessage that is not the last one
  rate,             // sequence numbers of a writer advance faster than samples can
  writers,          // more writers than the table of sequence numbers has places for
  protection,       // DDS-Security submessages whose structure or lengths are wrong
  unprotected,      // plain submessage in a domain whose governance requires protection
  reliability,      // a best-effort reader that acknowledges, or becomes reliable
  participants,  // a new participant while the remaining places are reserved for configured peers
  endpoints,     // a participant that announces more endpoints than permitted
  gap,           // single GAPs that are dropped; the rest of the datagram is passed on
  stream,        // TCP connections whose octets are no RTCP messages
  reader,        // TCP connections from which two threads of the library read
};
inline constexpr std::size_t kReasons = 19;

// As in log messages and counter names.
constexpr std::string_view to_string(Reason reason) {
  constexpr std::array<std::string_view, kReasons> kNames = {
      "none",      "header",     "submessage",  "sequence_number", "sequence_set",
      "fragment",  "parameters", "discovery",   "statistics",      "rate",
      "writers",   "protection", "unprotected", "reliability",     "participants",
      "endpoints", "gap",        "stream",      "reader"};
  return kNames.at(static_cast<std::size_t>(reason));
}

}  // namespace linegate::dds::guard
