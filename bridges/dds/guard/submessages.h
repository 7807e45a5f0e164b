// SPDX-License-Identifier: Apache-2.0
// Splits a datagram into RTPS 2.3 submessages and checks the fixed part of each (RTPS 2.3 9.4.5).
// Pure functions: no allocation, no state.
#pragma once

#include <optional>

#include "bridges/dds/guard/parameters.h"
#include "bridges/dds/guard/reason.h"
#include "bridges/dds/guard/wire.h"

namespace linegate::dds::guard {

inline constexpr std::size_t kHeader = 20;              // octets of the RTPS header
inline constexpr Number kLastNumber = Number{1} << 48;  // no writer reaches it
inline constexpr std::uint32_t kSetBits = 256;          // RTPS 2.3 9.4.2.6
inline constexpr std::uint8_t kInvalidate = 0x02;       // flag of INFO_TS
inline constexpr std::uint32_t kMaxSample = 4U << 20U;  // largest fragmented sample, in octets

enum class Kind : std::uint8_t {  // RTPS 2.3 table 9.8, DDS-Security 1.1 7.3.6
  pad = 0x01,
  acknack = 0x06,
  heartbeat = 0x07,
  gap = 0x08,
  info_ts = 0x09,
  info_src = 0x0C,
  info_reply_ip4 = 0x0D,
  info_dst = 0x0E,
  info_reply = 0x0F,
  nack_frag = 0x12,
  heartbeat_frag = 0x13,
  data = 0x15,
  data_frag = 0x16,
  sec_body = 0x30,
  sec_prefix = 0x31,
  sec_postfix = 0x32,
  srtps_prefix = 0x33,
  srtps_postfix = 0x34,
  statistics = 0x80,  // of Fast DDS
};

struct Submessage {
  Kind kind{};
  std::uint8_t flags = 0;
  bool open_end = false;  // octetsToNextHeader is 0: it extends to the end of the datagram
  std::size_t at = 0;     // offset of its header in the datagram
  Wire body;
};

// Whether it begins with an RTPS header: "RTPS", major version 2, 20 octets.
bool has_header(Octets datagram);

// Reads the submessage at `at`, >= kHeader and < datagram.size(). RTPS 2.3 9.4.5.1: the next one
// follows at a multiple of 4.
Reason split(Octets datagram, std::size_t at, Submessage& out);

// The fragments of a sample in a DATA_FRAG.
struct Fragments {
  std::uint32_t sample = 0;  // octets of the whole sample
  std::uint32_t size = 0;    // octets of a fragment, except the last one
  std::uint32_t first = 0;   // number of the first fragment, from 1
  std::uint32_t count = 0;
  std::uint64_t octets = 0;  // octets of these fragments
};

// The values in a checked submessage.
struct Content {
  std::uint32_t reader = 0;  // entity IDs
  std::uint32_t writer = 0;
  Number highest = 0;  // DATA, DATA_FRAG, HEARTBEAT, GAP: highest number of the writer; else 0
  Number first = 0;    // GAP: its first number; ACKNACK: all numbers below it are acknowledged
  Number listed = 0;   // GAP: number of sequence numbers from `first` to `highest`
  Fragments fragments;
  bool is_sample = false;  // DATA, DATA_FRAG
  bool has_data = false;
  bool has_key = false;        // DATA: the payload is the key alone
  bool ends_instance = false;  // according to its inline QoS
  std::optional<Guid> key;     // key hash in its inline QoS
  Owner instance;              // owner of that key
  Wire inline_qos;             // parameters, empty if there are none
  Wire payload;  // DATA with data or key: includes the encapsulation header; else empty
};

// Checks the body. Submessages of unknown kind, PAD, INFO_REPLY and those of DDS-Security are
// accepted unchecked.
Reason check(const Submessage& submessage, Content& out);

}  // namespace linegate::dds::guard
