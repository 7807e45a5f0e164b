// SPDX-License-Identifier: Apache-2.0
// The frames of the layer setting services (CiA 305): two identifiers, 8 bytes, distinguished by
// the command specifier in byte 0.
#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "stack/can/frame.h"

namespace linegate::lss {

inline constexpr std::uint32_t kMasterId = 0x7E5;  // from the LSS master to the slaves
inline constexpr std::uint32_t kSlaveId = 0x7E4;   // from the slaves to the master
inline constexpr std::uint8_t kNoNodeId = 0xFF;    // node-ID of an unconfigured device
inline constexpr std::uint8_t kNoBitTiming = 0xFF;

// The LSS address of a device: 1018h sub-index 1 to 4.
using Address = std::array<std::uint32_t, 4>;
enum Part : std::uint8_t { kVendor, kProduct, kRevision, kSerial };
inline constexpr std::uint8_t kParts = 4;

// The command specifier, byte 0.
enum class Command : std::uint8_t {
  switch_global = 0x04,         // byte 1: 0 waiting, 1 configuration. Unconfirmed
  configure_node_id = 0x11,     // byte 1: 1..127, FFh = none; answer: byte 1 error, 2 specific
  configure_bit_timing = 0x13,  // byte 1: table, 2: index in it; same answer
  activate_bit_timing = 0x15,   // bytes 1, 2: delay in ms. Unconfirmed
  store = 0x17,                 // same answer
  select_vendor = 0x40,         // bytes 1 to 4, also in the next three
  select_product = 0x41,
  select_revision = 0x42,
  select_serial = 0x43,    // answered by `selected`
  selected = 0x44,         // answer
  identify_vendor = 0x46,  // bytes 1 to 4, also in the next five
  identify_product = 0x47,
  identify_revision_low = 0x48,
  identify_revision_high = 0x49,
  identify_serial_low = 0x4A,
  identify_serial_high = 0x4B,   // answered by `identified`
  identify_unconfigured = 0x4C,  // answered by `unconfigured`
  identified = 0x4F,             // answer, also to fastscan
  unconfigured = 0x50,           // answer
  fastscan = 0x51,               // bytes 1 to 4: number, 5: bit check, 6: sub, 7: next
  inquire_vendor = 0x5A,  // answer: same command, value in bytes 1 to 4; also in the next three
  inquire_product = 0x5B,
  inquire_revision = 0x5C,
  inquire_serial = 0x5D,
  inquire_node_id = 0x5E,  // answer: same command, node-ID in byte 1
};

// base + offset: the commands for the parts of an address are consecutive.
constexpr Command next(Command base, unsigned offset) {
  return static_cast<Command>(static_cast<unsigned>(base) + offset);
}

// Error codes in the answers to configure_node_id, configure_bit_timing and store.
inline constexpr std::uint8_t kDone = 0;
inline constexpr std::uint8_t kRefused = 1;       // out of range, or not supported
inline constexpr std::uint8_t kMediumFailed = 2;  // store: access to the medium failed
inline constexpr std::uint8_t kSpecific = 0xFF;   // byte 2 has the manufacturer's error code

inline constexpr std::uint8_t kScanBegins = 0x80;  // bit check: all unconfigured devices answer

struct Message {
  Command command = Command::switch_global;
  std::uint32_t number = 0;            // bytes 1 to 4, LE
  std::array<std::uint8_t, 3> rest{};  // bytes 5 to 7

  std::uint8_t byte1() const { return static_cast<std::uint8_t>(number); }
  std::uint8_t byte2() const { return static_cast<std::uint8_t>(number >> 8U); }

  friend bool operator==(const Message&, const Message&) = default;
};

// id: kMasterId or kSlaveId.
can::Frame encode(std::uint32_t id, const Message& message);
// Returns nothing unless it is a classical data frame of 8 bytes. The command may be undefined.
std::optional<Message> decode(const can::Frame& frame);

// Bit rate of an index of table 0, in bit/s; nothing for an index without one (5 is reserved, 9 is
// automatic detection).
std::optional<std::uint32_t> bit_rate(std::uint8_t index);
std::optional<std::uint8_t> bit_timing_index(std::uint32_t bit_rate);
inline constexpr std::uint8_t kAutomaticBitRate = 9;

}  // namespace linegate::lss
