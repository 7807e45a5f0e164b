// SPDX-License-Identifier: Apache-2.0
// The commands of a line and their replies. Every Command gets exactly one Reply.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string_view>
#include <vector>

#include "stack/base/result.h"
#include "stack/base/time.h"
#include "stack/nmt/state.h"

namespace linegate::line {

// Append only: the numbers are part of the DDS contract.
enum class CommandKind : std::uint8_t {
  sdo_read,      // node, index, sub, code: 0, or kFromImage and kFromCache -> data
  sdo_write,     // node, index, sub, data
  local_read,    // index, sub of the line's own dictionary -> data. code: 0, or kListObjects (see
                 // there for node)
  local_write,   // index, sub, data. code: 0, or kWriteOwn
  output_write,  // entry (of the output layout), data: one output value, written by hand -> data:
                 // see ObjectWay. wrong_state while its node is not Operational
  emcy_send,     // code (emergency error code), error_register, data: 5 manufacturer bytes
  nmt,           // node (0 = all), nmt. Answered when the bus acknowledged the frame
  versions,      // -> text; answered by the gateway, never reaches a line
  network_read,  // network, node, index, sub -> data: sdo_read in another network (CiA 302-7), by
                 // the cheapest route of 1F2Ch; within the line's own network like sdo_read. entry:
                 // 0 or kAsDevice
  network_write,  // network, node, index, sub, data. entry as for network_read
  bus_restart,    // restarts the CAN controller after bus-off; executed by the owner of the line,
                  // never reaches the line
  routing_trace,  // code: duration in seconds (1..routing::Trace::kLongest) for which the line
                  // emits EventKind::routing_opened and routing_ended
  scan,           // node (0 = all except the own node) -> data: the identity and the PDOs that the
         // devices report (stack/scan/scanned_node.h). Writes nothing to them. Role manager,
         // one at a time; emits an event for each node meanwhile
  bus_fault,  // data: a change of the faults of a virtual bus, as text -> text; executed by the
              // owner of the line, never reaches the line
  boot,       // node (0 = all of the network list) -> data: the result of the repeated boot
              // process (stack/manager/boot_report.h), which begins with NMT reset communication
              // unless the node is to be kept alive. Role manager; emits an event for each result
              // meanwhile. An absent node ends with B when its boot time-out has passed
  configure,  // node (0 = all) -> data: stack/manager/configuration_report.h. code 0: compares
              // the device with its configuration (CiA 302-3); 1: boots it again and configures
              // it. Role manager, one at a time; EventKind::command_progress each second
  program,    // node, sub: number of the program (1F50h), data: the program, at most
              // manager::kLongestProgram -> data: see stack/line/program_service.h. Role manager;
              // EventKind::command_progress each second
  lss,        // code: lss::Procedure, data: its arguments -> data (stack/lss/procedure.h)
  object_write,  // node, index, sub, data: by PDO if a PDO of the line carries the object, else by
                 // SDO like sdo_write. code: kForceSdo, kKeepPdo -> data: see ObjectWay
  pdo_trigger,   // sends PDOs although nothing changed, as soon as inhibit time and SYNC permit:
                 // with a node, the PDO that is its RPDO `code`; without, the own TPDO `code`; code
  // 0: all that carry the byte `entry` of the outputs -> data: their numbers (2 each,
  // LE). Role device with devices: the TPDO `code` of the device `node`
  can_send,    // entry: identifier (bit 31: 29-bit identifier, bit 30: remote frame), data: 0..8
               // bytes. sub: 0, or for CAN FD the flags digit of candump: 4, with bit rate switch
               // 5. code: the length that a remote frame requests. Refused for identifiers that
               // services of the line use (Refusal::identifier_in_use)
  can_listen,  // for `code` seconds (0..Listening::kLongest, 0 = stop) frames that no service uses
               // are reported as EventKind::can_frame if their identifier (bit 31: 29-bit) equals
               // `entry` in all bits of the mask in data (4, LE; no data = all bits). At most
               // Listening::kMostASecond frames are reported each second
  object_create,  // index, sub: an application object in the own dictionary, until the line is
                  // stopped. code: kCreateObject, kRemoveObject. data (LE): data type (2), access
                  // (1, as od::Access), flags (1: bit 0 mappable, bit 2 in the image at byte
                  // `entry`), length (1) and name, length (1) and default, the same for lower and
                  // upper limit (length 0 = none)
  scan_apply,     // node (0 = all), code: 0 or kScan... bits -> data: like scan, but the result
                  // becomes the configuration of the line, which is made anew with it. Only if no
                  // nodes are configured, or nodes that a scan found
  pdo_request,    // requests TPDO `code` of the device `node` with a remote frame; node 0: the PDO
                  // that is RPDO `code` of the own node. Answered when the PDO was received;
                  // timed_out after `timeout`, or else LineConfig::sdo_timeout. bad_request: bit 30
                  // of its COB-ID does not allow RTR
  mpdo_write,     // node (0 = all), index, sub, data (up to 4 bytes): by an MPDO in destination
                  // address mode, by the own TPDO `code` (0 = the first in that mode).
                  // Answered when the bus acknowledged the frame -> data: the number of that TPDO
                  // (2, LE). unknown_entry: there is no such TPDO
};
inline constexpr std::size_t kCommandKinds = static_cast<std::size_t>(CommandKind::mpdo_write) + 1;
std::string_view name(CommandKind kind);

// Command::code of scan_apply. Configures error control and the analogue inputs of CiA 401 on
// devices where they are not configured (scan/set_up.h). Without it nothing is written to a device,
// not even when it boots.
inline constexpr std::uint16_t kScanSetUp = 1;
// Devices restore their defaults (1011h:1) and are reset before they are read.
inline constexpr std::uint16_t kScanRestore = 2;
// Command::code of sdo_read: a value that a scan read of the object may answer the command.
inline constexpr std::uint16_t kFromCache = 2;

// Why a command was not executed. Error::code with Domain::command. Append only: the numbers are
// part of the DDS contract.
enum class Refusal : std::uint8_t {
  none,
  busy,           // a queue is full, try again
  not_permitted,  // the line's access configuration does not allow it
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
};
std::string_view describe(Refusal refusal);

constexpr Error to_error(Refusal refusal) {
  return Error{Domain::command, static_cast<std::uint32_t>(refusal)};
}

// Command::code of sdo_read: a value in the image of the inputs that is valid and in time may
// answer the command.
inline constexpr std::uint16_t kFromImage = 1;
// Command::entry of network_read and network_write: the line treats the request as that of a device
// on its bus. It comes from the line's network, so the access rules of the line that it enters
// apply, in addition to those of this process; no route leads back over this line.
inline constexpr std::uint32_t kAsDevice = 1;
// Command::code of local_read: the reply is a list of the objects `index` to `entry` (0 = FFFFh),
// see list_objects(). node 0: of the own dictionary; else of the device file that this node is
// configured with, values included; bad_request if there is none.
inline constexpr std::uint16_t kListObjects = 2;
// Command::code of local_write, role device with devices: writes as the device itself, whatever the
// access of the object. Only for 1002h, 1008h to 100Ah and 2000h to 9FFFh.
inline constexpr std::uint16_t kWriteOwn = 1;
// Command::code of object_create.
inline constexpr std::uint16_t kCreateObject = 0;
inline constexpr std::uint16_t kRemoveObject = 1;  // all sub-indices that commands created
// Command::code of object_write, or-ed.
inline constexpr std::uint16_t kForceSdo = 1;  // by SDO, whatever PDOs map
inline constexpr std::uint16_t kKeepPdo = 2;   // do not request the PDO: pdo_trigger does

// Byte 0 of the data of a reply to object_write. With kByPdo it is followed by the PDO's number on
// this line (2, LE; the first of several), a PdoWait and, with PdoWait::values, the positions of
// the missing entries in the output layout (4 each, LE). A write to the own node's objects has no
// data. A reply to output_write has the same data, or none if no PDO of the line carries the entry.
enum ObjectWay : std::uint8_t { kBySdo, kByPdo };
// What the PDO waits for. The reply with `none` is sent when the bus acknowledged the frame, with
// `turn` and `bus` after Command::timeout, at the latest after kSendTime.
enum class PdoWait : std::uint8_t {
  none,         // sent: the bus acknowledged its frame
  update_time,  // LineConfig::pdo_update_time
  values,       // some of its values were never written and have no default
  operational,  // the own node is not Operational
  trigger,      // kKeepPdo
  turn,         // its inhibit time or its SYNC did not come within the time of the command
  bus,          // the bus did not acknowledge its frame, or accepts none
};
inline constexpr std::size_t kPdoWaits = 7;

// The longest time that a command of an unconfirmed service (NMT, PDO, CommandKind::can_send) waits
// for the acknowledgement of its frame.
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
  // sdo_... and network_...: from the command to its reply, repetitions included. 0 = no limit
  // except the line's own for each response of the device (LineConfig::sdo_timeout). For
  // unconfirmed services see kSendTime.
  Duration timeout{};
  // sdo_read and sdo_write: how often the transfer is repeated if it ended because a frame was
  // lost: with abort 0503 0000h, 0504 0000h, 0504 0003h or 0504 0004h of either side. Each attempt
  // waits for a response no longer than its share of timeout. The reply is that of the last
  // attempt.
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
