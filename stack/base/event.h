// SPDX-License-Identifier: Apache-2.0
// The event type: something that happened on a line, with a time and a number.
//
// Logs, metrics and the DDS topic Event all render this value; there is no other report of what
// happened. It is plain and of fixed size, so that emitting an event never allocates.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>

#include "stack/base/result.h"
#include "stack/base/time.h"

namespace linegate {

// The kind of an event, with the meaning of its node, code, value and data. `node` is the node-ID
// concerned, or 0 if the event concerns the line itself. New kinds are only appended, because these
// numbers are part of the DDS contract.
enum class EventKind : std::uint8_t {
  line_started,         // the line started. code: role (0 manager, 1 observer, 2 device)
  line_stopped,         // the line was shut down in an orderly way
  bus_state,            // code: new can::BusState, value: the previous one; data: TEC, REC
  bus_error,            // an error frame without a change of state. code: can::BusErrorClass bits.
                        // Reported at most once a second per code, like malformed_frame
  frames_lost,          // frames lost before the line received them. value: their number
  interface_failed,     // the interface cannot be used. code: errno
  interface_ready,      // the interface can be used (again)
  manager_state,        // code: new ManagerState, value: the previous one
  own_state,            // NMT state of the line's own node. code: new nmt::State, value: previous
  boot_up,              // boot-up message (CiA 301 7.2.8.3.3) of node
  node_state,           // NMT state of a node from its error control. code: new, value: previous
  heartbeat_lost,       // value: consumer heartbeat time (or life time) in ms. code: 0 heartbeat,
                        // 1 node guarding of node, 2 life guarding of the own node
  heartbeat_recovered,  // the first heartbeat after a loss. code: NMT state
  boot_result,          // the boot process of a node ended. code: NodeState::boot (0 = booted, or a
                        // letter); value: SDO abort code or offending value; data, if any: index
                        // (2, LE) and sub-index of the object, then 1 = value is an abort code, 2 =
                        // value was read from the object, 3 = value was the last one written; then
                        // the expected value (4, LE)
  emcy,                 // code: emergency error code, value: error register; data: 5 manufacturer
                        // bytes
  emcy_sent,            // EMCY of the own node, fields as for emcy
  configuration_error,  // a configured object could not be written, or a PDO or the stored
                        // parameters of the own node (index 1010h) cannot be used. code: SDO abort
                        // code; data: index (2, LE), sub-index
  pdo_length,       // code: PDO number, value: bytes mapped; data[0]: bytes received. node: sender
  pdo_timeout,      // the deadline of an RPDO passed. code: PDO number, value: deadline in ms
  pdo_recovered,    // the first reception after pdo_timeout. code: PDO number
  sync_lost,        // no SYNC within 1.5 periods. value: period in us
  malformed_frame,  // code: CAN identifier, value: length; data: the first 8 bytes. Reported at
                    // most once a second per identifier and node; if more were suppressed since,
                    // data from byte 8 is their number (4, LE), which includes others if many
                    // repeat. The last one of a series is reported when its second is over
  unexpected_node,  // a node that is not configured. code: its NMT state
  foreign_sdo,      // another SDO client uses node's default SDO server. code: CAN identifier
  sdo_abort,  // an SDO transfer with node was aborted. code: abort code; data: index, sub-index
  output_refused,  // an OutputWrite was refused. code: OutputRefusal; value: group number
  output_armed,  // first write of a group, which starts its watchdog. code: ms, value: group number
  output_watchdog,  // watchdog of a group expired. code: reaction bits applied; value: group number
  command_refused,  // code: Refusal, value: CommandKind
  events_lost,      // events could not be kept. data: first and last lost number, see EventLog
  clock_step,       // the wall clock was stepped. value: ms
  queue_full,       // a queue of the gateway overflowed. code: queue, value: number of lost entries
  duplicate_node_id,  // another device has the own node's node-ID. code: its NMT state, 0 for a
                      // boot-up message, nmt::State::unknown for an EMCY
  // Traffic of other nodes, seen by an observer:
  nmt_command,   // an NMT command. node: its addressee, 0 = all; code: its command specifier
  sdo_transfer,  // an SDO transfer with the server of node completed. code: 0 upload (read), 1
                 // download (written), bits 16-31: number of suppressed events (65535: or more);
                 // value: bytes; data: index (2, LE), sub-index, and the first bytes of the value
  pdo_mapping,   // the known parameters of a PDO of node changed. code: PDO number, value: 0 TPDO,
                 // 1 RPDO; data: 1 if its mapping is known completely, else 0
  layout_changed,  // the process image has a new layout. data: layout_id of inputs, outputs (8, LE)
  routing_refused,  // a request from or to another network was refused. code: SDO abort code; data:
                    // source network (2, LE; 0 = this process), target network (2, LE),
                    // target node, service (0 SDO, 1 EMCY, 2 PDO)
  emcy_routed,  // an EMCY of another network. node: its sender on this line, 0 = this line's own
                // node; code: emergency error code; data: error register, network (2, LE) and
                // node-ID of its source, hops, number
  // Connections to other networks, of a client on the line or of this process through the line.
  // Emitted only while CommandKind::routing_trace is active, for at most 50 connections a second.
  routing_opened,  // code: number of the connection, value: number of suppressed events before;
                   // data: source network (2, LE; 0 = this process), target network (2, LE) and
                   // node, outgoing interface, node-ID of the next gateway there or 0, hops
  routing_ended,   // code: SDO abort code, 0 = completed; value: bytes transferred; data: as
                  // routing_opened up to the gateway, service (0 none, 1 upload, 2 download), index
                  // (2, LE), sub-index, number of the connection (4, LE)
  node_scanned,  // a scan has read the identification objects of node. code: 0, or the SDO abort
                 // code that ended the scan early; value: number of objects read
  command_progress,  // progress of a long command. code: CommandKind, value: amount done; data:
                     // total amount (4, LE; 0 = unknown)
  lss_result,        // result of LSS for a device without a node-ID. code: lss::Verdict; value: its
                     // error, specific error (1 each); data: its LSS address (4 x 4, LE)
  foreign_manager,   // another NMT master is on the line; repeated every 10 s while it lasts.
                     // code: 1 an NMT command (value: its command specifier, data: its addressee, 0
                     // = all), 2 a message of flying masters (CiA 302-2; value: its identifier)
  can_frame,         // a frame that no service uses, while CommandKind::can_listen is active.
                     // code: identifier, bit 31: 29-bit identifier; value: bits 0-7 length, 8
                     // remote frame, 9 CAN FD, 10-11 piece, 16-31 number of suppressed events
                     // (65535: or more); data: from byte 16 x piece on. A longer frame causes
                     // several events
  // Events of the gateway, which belong to no line:
  gateway_started,   // value: number of lines
  gateway_reloaded,  // code: number of lines that were started, stopped or replaced; value: number
                     // of lines now
  gateway_reload_refused,  // value: number of errors
  // Events of nodes:
  spontaneous_change,  // a node left Operational, or booted, without an NMT command. code: its NMT
                       // state now (0: boot-up message), value: the previous one
  shared_node_id,  // two devices have the node-ID of node. code: the evidence: 1 two responses to
                   // one SDO request (data: index (2, LE), sub-index); heartbeats: 2 alternating
                   // NMT states, 3 two periods, 4 unchanged after a boot-up, 5 too many
  // Events of a device of the line's own (role device), node. The first kind also concerns
  // own_objects of the own node, with node 0:
  object_written,  // an object that is not in the image was written over SDO or MPDO. value: bytes;
                   // code: number of suppressed writes to it since the previous event (of more than
                   // 8 writes in a second the newest one is reported); data: index (2, LE),
                   // sub-index, and the first bytes of the value
  own_reset,       // an NMT command reset the device. code: the command specifier
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
  std::uint8_t length = 0;  // number of bytes used in data
  std::uint32_t code = 0;
  std::uint32_t value = 0;
  std::array<std::byte, 16> data{};
};

}  // namespace linegate
