// SPDX-License-Identifier: Apache-2.0
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
  sdo_read,       // node, index, sub, code: 0, or kFromImage and kFromCache -> data
  sdo_write,      // node, index, sub, data
  local_read,     // index, sub of the line's own dictionary -> data. code: 0, or kListObjects, then
                  // node as there
  local_write,    // index, sub, data. code: 0, or kWriteOwn
  output_write,   // entry (of the output layout), data: one output value, by a person -> data: see
                  // ObjectWay. wrong_state while its node is not Operational
  emcy_send,      // code (emergency error code), error_register, data: 5 manufacturer bytes
  nmt,            // node (0 = all), nmt. Answered when the frame was acknowledged on the bus
  versions,       // -> text; answered by the gateway, never reaches a line
  network_read,   // network, node, index, sub -> data: sdo_read in another network (CiA 302-7), by
                  // the cheapest route of 1F2Ch; in the line's own network sdo_read. entry: 0, or
                  // kAsDevice
  network_write,  // network, node, index, sub, data. entry as with network_read
  bus_restart,    // the CAN controller goes back to the bus after bus-off; carried out by the owner
                  // of the line, never reaches it
  routing_trace,  // code: for so many seconds (1..routing::Trace::kLongest) the line emits
                  // EventKind::routing_opened and routing_ended
  scan,  // node (0 = all but the own) -> data: what the devices say of themselves and their
         // PDOs (stack/scan/scanned_node.h). Nothing is written to them. Role manager, one at a
         // time; each node is an event meanwhile
  bus_fault,  // data: how the faults of a bus change that has none of its own, as text -> text;
              // carried out by the owner of the line, never reaches it
  boot,       // node (0 = all of the network list) -> data: how its boot process, made anew after
              // NMT reset communication unless it is to be kept alive, ended
              // (stack/manager/boot_report.h). Role manager; each result is an event meanwhile. An
              // absent node ends with B when its boot time-out is over
  configure,  // node (0 = all) -> data: stack/manager/configuration_report.h. code 0: compares what
              // it has with its configuration (CiA 302-3); 1: boots it anew and configures it.
              // Role manager, one at a time; EventKind::command_progress each second
  program,    // node, sub: number of the program (1F50h), data: the program, at most
              // manager::kLongestProgram -> data: see stack/line/program_service.h. Role manager;
              // EventKind::command_progress each second
  lss,        // code: lss::Procedure, data: its arguments -> data (stack/lss/procedure.h)
  object_write,  // node, index, sub, data: by PDO if a PDO of the line carries the object, else by
                 // SDO as sdo_write. code: kForceSdo, kKeepPdo -> data: see ObjectWay
  pdo_trigger,   // PDOs that are sent although nothing changed, as soon as they may: of the number
                 // `code`, with a node of that RPDO of it; code 0: all that carry the byte `entry`
                 // of the outputs -> data: their numbers (2 each, LE). Role device with devices:
                 // the TPDO `code` of the device `node`
  can_send,      // entry: identifier (bit 31: of 29 bits, bit 30: remote frame), data: 0..8 bytes.
                 // sub: 0, or for CAN FD candump's digit of flags: 4, with bit rate switch 5. code:
                 // the length a remote frame asks for. Not for identifiers that services of the
                 // line use (Refusal::identifier_in_use)
  can_listen,    // for so many seconds (code, 0..Listening::kLongest, 0 = not any more) frames that
                 // no service wants are EventKind::can_frame, those whose identifier (bit 31: of 29
                 // bits) is `entry` in all bits of the mask that data has (4, LE; none = all of
                 // them). At most Listening::kMostASecond a second are told
  object_create,  // index, sub: an object of an application in the own dictionary, until the line
                  // is stopped. code: kCreateObject, kRemoveObject. data (LE): data type (2),
                  // access (1, as od::Access), flags (1: bit 0 mappable, bit 2 in the image at byte
                  // `entry`), length (1) and name, length (1) and default, the same for lower and
                  // upper limit (0 = none)
  scan_apply,     // node (0 = all), code: 0 or kScan... bits -> data: like scan, but what it finds
                  // becomes the configuration of the line, which is made anew with it. Only where
                  // no nodes are configured, or such that a scan found
  pdo_request,    // a device is asked for its TPDO `code` with a remote frame; node 0: the device
                  // that sends RPDO `code` of the own node. Answered when the PDO came; timed_out
                  // after `timeout`, or else LineConfig::sdo_timeout. bad_request: bit 30 of its
                  // COB-ID says that there is no RTR
  mpdo_write,     // node (0 = all), index, sub, data (up to 4 bytes): by an MPDO in destination
                  // address mode, of the own TPDO `code` (0 = the first in that mode).
  // Answered when the frame was acknowledged -> data: the number of that TPDO (2, LE).
  // unknown_entry: it has none
};
inline constexpr std::size_t kCommandKinds = static_cast<std::size_t>(CommandKind::mpdo_write) + 1;
std::string_view name(CommandKind kind);

// Command::code of scan_apply.
// Error control and the analogue inputs of CiA 401 are set up where they are not (scan/set_up.h).
// Without it nothing is written to a device, not when it boots either.
inline constexpr std::uint16_t kScanSetUp = 1;
// Devices restore their defaults (1011h:1) and are reset before they are read.
inline constexpr std::uint16_t kScanRestore = 2;
// Command::code of sdo_read: what a scan read of the object is the answer, if it did.
inline constexpr std::uint16_t kFromCache = 2;

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
  identifier_in_use,  // a service of the line uses this CAN identifier
  bound_entry,        // the output follows an input of another line: nothing else writes it
  no_acknowledge,     // the frame was not acknowledged on the bus in time: it may be sent yet
  awaits_turn,        // the frame waits for the end of an inhibit time, SYNC, or the remote request
                      // of a PDO: it is sent then
};
std::string_view describe(Refusal refusal);

constexpr Error to_error(Refusal refusal) {
  return Error{Domain::command, static_cast<std::uint32_t>(refusal)};
}

// Command::code of sdo_read: a value that the image of the inputs has, valid and in time, will do.
inline constexpr std::uint16_t kFromImage = 1;
// Command::entry of network_read and network_write: the request is that of a device on the bus of
// this line. It comes from the network of the line, so the rules of access of the line that is
// entered apply to it, beside what this process may do there; no route leads back over this line.
inline constexpr std::uint32_t kAsDevice = 1;
// Command::code of local_read: no value, but a list of the objects `index` to `entry` (0 = FFFFh),
// see list_objects(): of the own dictionary with node 0, else of the device file that the node
// `node` is configured with, values included; bad_request if there is none.
inline constexpr std::uint16_t kListObjects = 2;
// Command::code of local_write, role device with devices: as the device itself does it, whatever
// the access of the object. Of 1002h, 1008h to 100Ah and 2000h to 9FFFh alone.
inline constexpr std::uint16_t kWriteOwn = 1;
// Command::code of object_create.
inline constexpr std::uint16_t kCreateObject = 0;
inline constexpr std::uint16_t kRemoveObject = 1;  // all sub-indices that were created
// Command::code of object_write, or-ed.
inline constexpr std::uint16_t kForceSdo = 1;  // by SDO whatever is mapped
inline constexpr std::uint16_t kKeepPdo = 2;   // the PDO is not asked for: pdo_trigger does

// What an object_write answers in byte 0. By PDO also its number here (2, LE; the first of
// several), a PdoWait and, of PdoWait::values, the positions of these entries in the output layout
// (4 each, LE); the own node's objects are written without a way: no data. An output_write answers
// the same, but nothing where no PDO of the line carries the entry.
enum ObjectWay : std::uint8_t { kBySdo, kByPdo };
// What the PDO waits for. `none` is answered when the frame was acknowledged, `turn` and `bus`
// after Command::timeout, at the latest after kSendTime.
enum class PdoWait : std::uint8_t {
  none,         // it was sent: its frame was acknowledged on the bus
  update_time,  // LineConfig::pdo_update_time
  values,       // values of it that were never written and have no default
  operational,  // the own node is not Operational
  trigger,      // kKeepPdo
  turn,         // its inhibit time or its SYNC, longer than the command could wait
  bus,          // the bus did not acknowledge its frame, or takes none
};
inline constexpr std::size_t kPdoWaits = 7;

// How long a service that is not confirmed (NMT, PDO, CommandKind::can_send) waits for the
// acknowledgement of its frame at most.
inline constexpr Duration kSendTime = std::chrono::seconds(1);

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
  // but the line's for each answer of the device (LineConfig::sdo_timeout). Of a service that is
  // not confirmed: see kSendTime.
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
