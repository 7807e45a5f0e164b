// What can be asked of a line, and its answer. Every Command gets exactly one Reply.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string_view>
#include <vector>

#include "stack/base/result.h"
#include "stack/base/time.h"
#include "stack/nmt/state.h"

namespace linegate::line {

// Grows at the end only: the numbers are those of the DDS contract.
enum class CommandKind : std::uint8_t {
  sdo_read,       // node, index, sub, code: 0 or kFromCache -> data
  sdo_write,      // node, index, sub, data
  local_read,     // index, sub of the line's own dictionary -> data
  local_write,    // index, sub, data
  output_write,   // entry (of the output layout), data: one output value, by a person
  emcy_send,      // code (emergency error code), error_register, data: 5 manufacturer bytes
  nmt,            // node (0 = all), nmt
  versions,       // -> text; answered by the gateway, never reaches a line
  network_read,   // network, node, index, sub -> data: sdo_read in another network (CiA 302-7), by
                  // the cheapest route of 1F2Ch; in the line's own network sdo_read
  network_write,  // network, node, index, sub, data
  bus_restart,    // the CAN controller goes back to the bus after bus-off; carried out by the owner
                  // of the line, never reaches it
  routing_trace,  // code: for so many seconds (1..routing::Trace::kLongest) the line emits
                  // EventKind::routing_opened and routing_ended
  scan,          // node (0 = all but the own) -> data: what the devices say of themselves and their
                 // PDOs (stack/scan/report.h). Nothing is written to them. Role manager, one at a
                 // time; each node is an event meanwhile
  bus_fault,     // data: how the faults of a bus change that has none of its own, as text -> text;
                 // carried out by the owner of the line, never reaches it
  boot,          // node (0 = all): its boot process anew (CiA 302-2)
  configure,     // node (0 = all), code: 0 verify, 1 apply its configuration (CiA 302-3)
  program,       // node, sub: number of the program (1F50h), data: the program
  lss,           // code: the service (CiA 305), data: its arguments -> data
  object_write,  // node, index, sub, data: by PDO if the object is mapped, else by SDO
  pdo_trigger,   // code: number of a TPDO, which is sent now
  can_send,      // entry: identifier, data: a frame
  can_listen,    // entry: identifier, code: for so many seconds frames of it are events
  object_create,  // index, sub, data: an object of the line's own dictionary
  scan_apply,     // node (0 = all), code: 0 or kScan... bits -> data: like scan, but what it finds
                  // becomes the configuration of the line, which is made anew with it. Only where
                  // no nodes are configured, or such that a scan found
};
std::string_view name(CommandKind kind);

// Command::code of scan_apply.
// Error control and the analogue inputs of CiA 401 are set up where they are not (scan/set_up.h).
// Without it nothing is written to a device, not when it boots either.
inline constexpr std::uint16_t kScanSetUp = 1;
// Devices restore their defaults (1011h:1) and are reset before they are read.
inline constexpr std::uint16_t kScanRestore = 2;
// Command::code of sdo_read: what a scan read of the object is the answer, if it did.
inline constexpr std::uint16_t kFromCache = 1;

// Why a command was not carried out. Error::code with Domain::command.
// Grows at the end only: the numbers are those of the DDS contract.
enum class Refusal : std::uint8_t {
  none,
  busy,           // a queue is full, try again
  not_permitted,  // the line's access configuration does not allow it
  bad_request,    // a field is out of range or fields do not go together
  unknown_line,
  unknown_entry,      // no such output entry
  wrong_incarnation,  // meant for another start of the gateway
  wrong_role,         // not possible in the line's role
  wrong_state,        // not possible in the present state (of NMT, or of the bus)
  inhibited,          // EMCY inhibit time is running
  timed_out,          // the command's own time-out passed
  line_down,          // the interface is not usable
  stale_layout,       // layout_id is not the current one
  cancelled,          // the gateway is stopping
  wrong_interface,    // not possible with the line's interface
};
std::string_view describe(Refusal refusal);

constexpr Error to_error(Refusal refusal) {
  return Error{Domain::command, static_cast<std::uint32_t>(refusal)};
}

struct Command {
  std::uint64_t tag = 0;  // chosen by the caller, returned in the Reply
  CommandKind kind = CommandKind::versions;
  std::uint8_t node = 0;
  std::uint16_t network = 0;  // network-ID
  std::uint16_t index = 0;
  std::uint8_t sub = 0;
  nmt::Command nmt = nmt::Command::start;
  std::uint16_t code = 0;
  std::uint8_t error_register = 0;
  std::uint32_t entry = 0;
  // sdo_... and network_...: from the command to its reply, all repetitions included. 0 = no limit
  // but the line's for each answer of the device (LineConfig::sdo_timeout).
  Duration timeout{};
  // sdo_read and sdo_write: how often the transfer is begun anew when it ended because a frame was
  // lost: with abort 0503 0000h, 0504 0000h, 0504 0003h or 0504 0004h of either side. Each attempt
  // waits for an answer no longer than its part of timeout. The reply is that of the last one.
  std::uint8_t repeats = 0;
  std::vector<std::byte> data;
};

struct Reply {
  std::uint64_t tag = 0;
  // Domain::none: done. Domain::sdo: aborted with that code. Domain::command: a Refusal.
  Error error;
  std::vector<std::byte> data;

  bool ok() const { return error.domain == Domain::none; }
};

}  // namespace linegate::line
