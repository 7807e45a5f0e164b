// SPDX-License-Identifier: Apache-2.0
// Output values from a subscriber, and the reactions if it stops writing.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "stack/base/time.h"

namespace linegate::line {

// Reactions of the output watchdog (IXXAT manual 5.17), or-ed. At most one NMT reaction.
enum WatchdogReaction : std::uint8_t {
  kHoldOutputs = 0x00,
  kZeroOutputs = 0x01,        // the group's outputs become 0 and are sent
  kNmtPreOperational = 0x02,  // to all nodes; manager role only
  kNmtStop = 0x04,
  kNmtResetCommunication = 0x08,
  kNmtResetNode = 0x10,
  kSendEmcy = 0x20,      // EMCY 00 62 81 00 00 00 00 00
  kHeartbeatOff = 0x40,  // device role only
};

// One entry of the output layout.
struct OutputValue {
  // A mapping entry has at most 255 bits (CiA 301 7.5.2.36), on lines of CANopen FD, too.
  static constexpr std::size_t kMaxLength = 32;

  std::uint32_t entry = 0;
  std::uint8_t length = 0;                   // bytes in data
  std::array<std::byte, kMaxLength> data{};  // little-endian
};

// A run of bytes of the output area; must lie in the group's entries.
struct OutputBytes {
  std::uint32_t offset = 0;
  std::vector<std::byte> data;
};

// Applied completely or not at all, and never split across a SYNC. Without values and bytes it only
// feeds the watchdog and takes an arming number: a handshake (IXXAT manual 5.17, CMM_HandShake).
struct OutputWrite {
  std::uint16_t group = 0;
  std::uint64_t layout_id = 0;  // of the output layout that it refers to
  std::uint64_t arming = 0;     // a new one re-arms the group after a watchdog reaction
  Duration watchdog{};          // 0 = none; armed by the first write
  std::uint8_t reactions = kHoldOutputs;
  std::vector<OutputValue> values{};
  std::vector<OutputBytes> bytes{};
  std::string client{};             // name of the writer, for OutputState
  std::uint32_t client_number = 0;  // as Command::client
  // Values of a line of another gateway: for a group with OutputGroup::forwarded, and for no other
  bool forwarded = false;
};

// The value of an output that follows an input, see LineConfig::bound.
struct BoundValue {
  std::uint32_t entry = 0;  // of the output layout; or Line::kForwarded | place in
                            // LineConfig::forwarding
  std::uint64_t value = 0;
  bool always = false;       // request its PDO even if no value changed
  bool valid = true;         // false: the entry becomes invalid, so its PDO is held back
  std::uint16_t source = 0;  // number of the PDO that carried the value where it was received
  // Of an entry of more than 64 bits: 8 bytes of it, those from byte 8 * part on. All parts of an
  // entry that are written are adjacent.
  std::uint8_t part = 0;
};

// Why an OutputWrite was not applied. Append only: DDS contract.
enum class OutputRefusal : std::uint8_t {
  none,
  not_permitted,  // the access of the line (for the client) does not allow it
  stale_layout,
  unknown_group,
  unknown_entry,  // no such entry, or not in this group
  bad_length,
  not_armed,        // after a watchdog reaction, without a new arming number
  bad_reaction,     // reactions that exclude each other
  wrong_role,       // not possible in the line's role: an observer transmits nothing
  bound_entry,      // an output follows an input of another line and cannot be written
  busy,             // too many other clients have unfinished requests, see RequestBudget
  no_right,         // the role of the client's certificate does not allow it, or it is revoked
  written_by_name,  // an OutputWrite of a group that is configured to be written by name
  bad_value,        // a value by name that its output cannot have
  // Why a value of another gateway is not forwarded to an output
  source_missing,   // the line of the other gateway has no such input
  source_type,      // the input has another data type, length or scaling than the output
  source_disputed,  // several gateways of that name publish the line
  source_silent,    // no value yet: its line is not, or not completely, received
  source_invalid,   // no value yet: its line is received, and the input is not valid
};
std::string_view describe(OutputRefusal refusal);

}  // namespace linegate::line
