// SPDX-License-Identifier: Apache-2.0
// The one event type: something that happened on a line, with a time and a number.
//
// Logs, metrics and the DDS topic Event all render this value; nothing else says that something
// happened. It is plain and of fixed size, so that emitting one never allocates.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>

#include "stack/base/result.h"
#include "stack/base/time.h"

namespace linegate {

// What happened, and what node, code, value and data of the Event say then. `node` is the node-ID
// concerned, 0 where the event concerns the line itself. Grows at the end only: these numbers are
// those of the DDS contract.
enum class EventKind : std::uint8_t {
  line_started,  // the line began to run. code: role (0 manager, 1 observer, 2 device)
  line_stopped,  // the line was stopped in good order
  bus_state,     // code: new can::BusState, value: the one before; data: TEC, REC
  bus_error,     // an error frame without a change of state. code: can::BusErrorClass bits. Told
                 // at most once a second per code, as malformed_frame
  frames_lost,   // frames lost before the line saw them. value: how many
  interface_failed,  // the interface cannot be used. code: errno
  interface_ready,   // the interface can be used (again)
  manager_state,     // code: new ManagerState, value: the one before
  own_state,         // NMT state of the line's own node. code: new nmt::State, value: before
  boot_up,           // boot-up message (CiA 301 7.2.8.3.3) of node
  node_state,        // NMT state of a node as its error control shows it. code: new, value: before
  heartbeat_lost,    // value: consumer time (or life time) in ms. code: 0 heartbeat, 1 node
                     // guarding of node, 2 life guarding: the own node is not guarded any more
  heartbeat_recovered,  // the first heartbeat after a loss. code: NMT state
  boot_result,          // a node's boot ended. code: NodeState::boot (0 = booted, or a letter);
                        // value: SDO abort code or offending value; data, where there is one: index
                        // (2, LE) and sub-index of the object, 1 = value is an abort code, 2 = it
                        // was found there, 3 = it was the last that was written, and what was
                        // expected (4, LE)
  emcy,                 // code: emergency error code, value: error register; data: 5 manufacturer
                        // bytes
  emcy_sent,            // the own node's EMCY, fields as emcy
  configuration_error,  // a configured object could not be written, or a PDO or what was stored of
                        // the own node (index 1010h) cannot be used. code: SDO abort code; data:
                        // index (2, LE), sub-index
  pdo_length,       // code: PDO number, value: bytes mapped; data[0]: bytes received. node: sender
  pdo_timeout,      // an RPDO's deadline passed. code: PDO number, value: deadline in ms
  pdo_recovered,    // the first reception after pdo_timeout. code: PDO number
  sync_lost,        // no SYNC within 1.5 periods. value: period in us
  malformed_frame,  // code: CAN identifier, value: length; data: the first 8 bytes. Told at most
                    // once a second per identifier and node; if more were held back since, data
                    // from byte 8 is how many (4, LE), others among them if many repeat. The last
                    // of a series is told when the second is over
  unexpected_node,  // a node that is not configured. code: NMT state seen
  foreign_sdo,      // somebody else uses node's default SDO server. code: CAN identifier
  sdo_abort,        // an SDO transfer with node ended. code: abort code; data: index, sub-index
  output_refused,   // an OutputWrite was refused. code: OutputRefusal; value: group number
  output_armed,     // first write of a group: its watchdog runs. code: ms, value: group number
  output_watchdog,  // a group's watchdog fired. code: reaction bits applied; value: group number
  command_refused,  // code: Refusal, value: CommandKind
  events_lost,      // events could not be kept. data: first and last lost number, see EventLog
  clock_step,       // the wall clock was stepped. value: ms
  queue_full,       // a queue of the gateway overflowed. code: which, value: how many were lost
  duplicate_node_id,  // another device has the own node's node-ID. code: the state it showed, 0 at
                      // its boot-up; nmt::State::unknown if it sent an EMCY
  // What an observer hears of others:
  nmt_command,     // an NMT command. node: to which, 0 = all; code: its command specifier
  sdo_transfer,    // an SDO transfer with the server of node ended well. code: 0 upload (read), 1
                   // download (written), bits 16-31 how many more were not told (65535: or more);
                   // value: bytes; data: index (2, LE), sub-index, and the first bytes of the value
  pdo_mapping,     // what is known of a PDO of node has changed. code: PDO number, value: 0 TPDO, 1
                   // RPDO; data: 1 if its mapping is known completely, else 0
  layout_changed,  // the process image has a new layout. data: layout_id of inputs, outputs (8, LE)
  routing_refused,  // a request of or to another network was refused. code: SDO abort code; data:
                    // network it came from (2, LE; 0 = this process), target network (2, LE),
                    // target node, service (0 SDO, 1 EMCY, 2 PDO)
  emcy_routed,  // an EMCY of another network. node: which sent it here, 0 = this line's own node;
                // code: emergency error code; data: error register, network (2, LE) and node-ID of
                // its source, hops, number
  // Of connections to other networks that a client on the line, or this process through it, has;
  // only while somebody asked for it (CommandKind::routing_trace), and of 50 a second.
  routing_opened,  // code: number of the connection, value: how many before were not told; data:
                   // network it comes from (2, LE; 0 = this process), target network (2, LE) and
                   // node, interface that it leaves by, node-ID of the next gateway there or 0,
                   // hops
  routing_ended,   // code: SDO abort code, 0 = it ended well; value: bytes transferred; data: as
                  // routing_opened up to the gateway, service (0 none, 1 upload, 2 download), index
                  // (2, LE), sub-index, number of the connection (4, LE)
  node_scanned,  // a scan has read what node says of itself. code: 0, or the SDO abort code that
                 // ended it early; value: how many objects were read
  command_progress,  // what a command that takes long has done. code: CommandKind, value: how much;
                     // data: of how much (4, LE; 0 = not known)
  lss_result,        // what LSS did with a device without a node-ID. code: lss::Verdict; value: its
                     // error, specific error (1 each); data: its LSS address (4 x 4, LE)
  foreign_manager,   // another NMT master is on the line; told every 10 s as long as it goes on.
                     // code: 1 an NMT command (value: its command specifier, data: to which node, 0
                     // = all), 2 a message of flying masters (CiA 302-2; value: its identifier)
  can_frame,         // a frame that no service wanted, while somebody asked for such (CommandKind::
                     // can_listen). code: identifier, bit 31: of 29 bits; value: bits 0-7 length,
                     // 8 remote frame, 9 CAN FD, 10-11 piece, 16-31 how many before were not told
                     // (65535: or more); data: from byte 16 x piece on. Longer frames are several
                     // events
  // Of the gateway, and of no line:
  gateway_started,   // value: how many lines
  gateway_reloaded,  // code: how many lines started, stopped or were made anew; value: how many
                     // there are now
  gateway_reload_refused,  // value: how many errors were found
  // Of nodes:
  spontaneous_change,  // a node left Operational, or booted, without an NMT command. code: NMT
                       // state it shows now (0: its boot-up message), value: the one before
  shared_node_id,  // two devices have the node-ID of node. code: how that was found: 1 two answers
                   // to one SDO request (data: index (2, LE), sub-index), heartbeats: 2 of two NMT
                   // states in turn, 3 of two rhythms, 4 after a boot-up as before, 5 too many
  // Of a device of the line's own (role device), node; the first one also of own_objects of the own
  // node, node 0:
  object_written,  // an object that is not in the image was written over SDO or MPDO. value: bytes;
                   // code: how many writes to it since the event before have none (of more than 8
                   // in a second the newest has); data: index (2, LE), sub-index, and the first
                   // bytes of the value
  own_reset,       // an NMT command reset it. code: the command specifier
  time_received,   // a TIME message; at most one event a second. data: UTC in ns (8, LE)
};
inline constexpr std::size_t kEventKinds = 54;

// Lower-case name with hyphens, e.g. "heartbeat-lost".
std::string_view name(EventKind kind);

enum class EventSeverity : std::uint8_t { info, warning, error };
EventSeverity severity(EventKind kind);
// "info", "warning", "error".
std::string_view name(EventSeverity severity);

struct Event {
  std::uint64_t number = 0;  // 1, 2, 3, ... per line and incarnation, without gaps
  Instant time{};
  EventKind kind = EventKind::line_started;
  std::uint8_t node = 0;    // 1..127, or 0 for the line
  std::uint8_t length = 0;  // bytes used in data
  std::uint32_t code = 0;
  std::uint32_t value = 0;
  std::array<std::byte, 16> data{};
};

}  // namespace linegate
