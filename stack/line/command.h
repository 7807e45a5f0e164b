// SPDX-License-Identifier: Apache-2.0
// The commands of a line and their replies. Every Command gets exactly one Reply.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string_view>
#include <vector>

#include "stack/base/result.h"
#include "stack/base/time.h"
#include "stack/line/replies.h"
#include "stack/line/requests.h"

namespace linegate::line {

// Why a command was not executed. Error::code with Domain::command. Append only: the numbers are
// part of the DDS contract.
enum class Refusal : std::uint8_t {
  none,
  busy,           // a queue is full, try again
  not_permitted,  // the access of the line (for the client) does not allow it
  bad_request,    // a field is out of range, or fields are inconsistent
  unknown_line,
  unknown_entry,      // no such output entry
  wrong_incarnation,  // addresses another incarnation (start) of the gateway
  wrong_role,         // not possible in the line's role
  wrong_state,        // not possible in the present state (of NMT, or of the bus)
  inhibited,          // the EMCY inhibit time has not passed
  timed_out,          // the command's own time-out passed
  line_down,          // the interface is not usable
  stale_layout,       // layout_id is not the current one
  cancelled,          // the gateway is stopping
  wrong_interface,    // not possible with the line's interface
  identifier_in_use,  // a service of the line uses this CAN identifier
  bound_entry,        // the output follows an input of another line and cannot be written
  no_acknowledge,     // the bus did not acknowledge the frame in time; it may still be sent
  awaits_turn,        // waits for an inhibit time, SYNC, or the remote request of a PDO; sent then
  no_right,           // the role of the client's certificate does not allow it, or it is revoked
  image_pdo,  // the write would change a PDO of the image, which its node's configuration has
};
std::string_view describe(Refusal refusal);

constexpr Error to_error(Refusal refusal) {
  return Error{Domain::command, static_cast<std::uint32_t>(refusal)};
}

// The longest time that a command of an unconfirmed service (NMT, PDO, CommandKind::can_send) waits
// for the acknowledgement of its frame.
inline constexpr Duration kSendTime = std::chrono::seconds(1);

struct Command {
  std::uint64_t tag = 0;  // chosen by the caller, returned in the Reply
  // SDO transfers and requests to other networks: from the command to its reply, repetitions
  // included. 0 = no limit except the line's own for each response of the device
  // (LineConfig::sdo_timeout). For unconfirmed services see kSendTime.
  Duration timeout{};
  // The client whose request it is: a number of the owner of the line, for events and
  // RequestBudget; 0 = the owner itself.
  std::uint32_t client = 0;
  // Emit EventKind::command_accepted unless the command is refused.
  bool audited = false;
  Request request{};
};

inline CommandKind kind(const Command& command) {
  return kind(command.request);
}
inline std::uint8_t node_of(const Command& command) {
  return node_of(command.request);
}

struct Reply {
  std::uint64_t tag = 0;
  // Domain::none: done. Domain::sdo: aborted with that code. Domain::command: a Refusal.
  Error error{};
  ReplyData data{};

  bool ok() const { return error.domain == Domain::none; }
  // The value of an object, or a text; empty for every other type of result.
  const std::vector<std::byte>& bytes() const { return bytes_of(data); }
};

}  // namespace linegate::line
