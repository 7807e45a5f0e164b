// SPDX-License-Identifier: Apache-2.0
// The kinds of events: a struct for each kind, with its parameters. The structs are trivially
// copyable and have at most 24 bytes, so emitting an event never allocates. bridges/dds/event_codec
// converts them to code, value and data of the topic Event.
#pragma once

#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <type_traits>
#include <variant>

#include "stack/base/abort_code.h"
#include "stack/base/time.h"

// Enumerations of higher parts of the stack, whose headers have their enumerators.
namespace linegate::can {
enum class BusState : std::uint8_t;
}
namespace linegate::nmt {
enum class State : std::uint8_t;
enum class Command : std::uint8_t;
enum class FlyingMasterState : std::uint8_t;
enum class SleepPhase : std::uint8_t;
enum class SleepCause : std::uint8_t;
}  // namespace linegate::nmt
namespace linegate::lss {
enum class Verdict : std::uint8_t;
}
namespace linegate::pdo {
enum class PdoKind : std::uint8_t;
}
namespace linegate::manager {
enum class ManagerState : std::uint8_t;
}
namespace linegate::srdo {
enum class Fault : std::uint8_t;
}
namespace linegate::routing {
enum class RoutedService : std::uint8_t;
}
namespace linegate::line {
enum class Role : std::uint8_t;
enum class OutputRefusal : std::uint8_t;
enum class Refusal : std::uint8_t;
enum class CommandKind : std::uint8_t;
}  // namespace linegate::line

namespace linegate {

// Append only: the numbers are part of the DDS contract. Names, severities and rate limits use it;
// the parameters are in the alternatives of EventData.
enum class EventKind : std::uint8_t {
  line_started,
  line_stopped,
  bus_state,
  bus_error,
  frames_lost,
  interface_failed,
  interface_ready,
  manager_state,
  own_state,
  boot_up,
  node_state,
  heartbeat_lost,
  heartbeat_recovered,
  boot_result,
  emcy,
  emcy_sent,
  configuration_error,
  pdo_length,
  pdo_timeout,
  pdo_recovered,
  sync_lost,
  malformed_frame,
  unexpected_node,
  foreign_sdo,
  sdo_abort,
  output_refused,
  output_armed,
  output_watchdog,
  command_refused,
  events_lost,
  clock_step,
  queue_full,
  duplicate_node_id,
  nmt_command,
  sdo_transfer,
  pdo_mapping,
  layout_changed,
  routing_refused,
  emcy_routed,
  routing_opened,
  routing_ended,
  node_scanned,
  command_progress,
  lss_result,
  foreign_manager,
  can_frame,
  gateway_started,
  gateway_reloaded,
  gateway_reload_refused,
  spontaneous_change,
  shared_node_id,
  object_written,
  own_reset,
  time_received,
  command_accepted,
  output_owner,
  client_limited,
  journal_state,
  dds_process_ended,
  routing_unanswered,
  srdo_state,
  sdo_connection,
  flying_master,
  sleep_state,
};

// "node" in the comments is Event::node. A member `suppressed` is the number of events that were
// suppressed since the previous one of the series, see RepeatLimit; 0 where the event is emitted.
namespace event {

// A member `client` is the number that the owner of the line gave to the client (DDS participant)
// whose request caused the event; 0 = none.

// --- the line and its bus ------------------------------------------------------------------------

// The line started.
struct LineStarted {
  static constexpr EventKind kKind = EventKind::line_started;
  line::Role role{};

  friend bool operator==(const LineStarted&, const LineStarted&) = default;
};

// The line was shut down in an orderly way.
struct LineStopped {
  static constexpr EventKind kKind = EventKind::line_stopped;

  friend bool operator==(const LineStopped&, const LineStopped&) = default;
};

// The CAN controller or the interface entered another state.
struct BusState {
  static constexpr EventKind kKind = EventKind::bus_state;
  can::BusState state{};
  can::BusState before{};
  std::uint8_t transmit_errors = 0;  // TEC
  std::uint8_t receive_errors = 0;   // REC

  friend bool operator==(const BusState&, const BusState&) = default;
};

// An error frame without a change of state. Reported at most once a second per `errors`.
struct BusError {
  static constexpr EventKind kKind = EventKind::bus_error;
  std::uint32_t errors = 0;  // can::BusErrorClass bits
  std::uint32_t suppressed = 0;

  friend bool operator==(const BusError&, const BusError&) = default;
};

// Frames were lost before the line received them.
struct FramesLost {
  static constexpr EventKind kKind = EventKind::frames_lost;
  std::uint32_t frames = 0;

  friend bool operator==(const FramesLost&, const FramesLost&) = default;
};

// The interface cannot be used.
struct InterfaceFailed {
  static constexpr EventKind kKind = EventKind::interface_failed;
  std::uint32_t error = 0;  // errno

  friend bool operator==(const InterfaceFailed&, const InterfaceFailed&) = default;
};

// The interface can be used (again).
struct InterfaceReady {
  static constexpr EventKind kKind = EventKind::interface_ready;

  friend bool operator==(const InterfaceReady&, const InterfaceReady&) = default;
};

// Events could not be kept. Takes their place in the sequence, see EventLog.
struct EventsLost {
  static constexpr EventKind kKind = EventKind::events_lost;
  std::uint64_t first = 0;  // number of the first lost event
  std::uint64_t last = 0;

  friend bool operator==(const EventsLost&, const EventsLost&) = default;
};

// The wall clock was stepped.
struct ClockStep {
  static constexpr EventKind kKind = EventKind::clock_step;
  std::chrono::milliseconds step{};  // without its sign

  friend bool operator==(const ClockStep&, const ClockStep&) = default;
};

enum class Queue : std::uint8_t { requests = 1 };

// A queue of the gateway overflowed.
struct QueueFull {
  static constexpr EventKind kKind = EventKind::queue_full;
  Queue queue = Queue::requests;
  std::uint32_t lost = 0;  // number of entries

  friend bool operator==(const QueueFull&, const QueueFull&) = default;
};

// The process image has a new layout.
struct LayoutChanged {
  static constexpr EventKind kKind = EventKind::layout_changed;
  std::uint64_t inputs = 0;   // image::Layout::id
  std::uint64_t outputs = 0;  // image::Layout::id

  friend bool operator==(const LayoutChanged&, const LayoutChanged&) = default;
};

// A frame that a service received and cannot decode. node: the node concerned. Reported at most
// once a second per identifier and node; the last one of a series is reported when its second is
// over. `suppressed` includes other identifiers if many repeat.
struct MalformedFrame {
  static constexpr EventKind kKind = EventKind::malformed_frame;
  std::uint32_t identifier = 0;     // 11 or 29 bits
  std::uint8_t length = 0;          // of the frame, 0..64
  std::array<std::byte, 8> data{};  // its first bytes, at most `length` of them
  std::uint32_t suppressed = 0;

  friend bool operator==(const MalformedFrame&, const MalformedFrame&) = default;
};

// A frame that no service uses, while CommandKind::can_listen is active. A frame of more than 16
// bytes causes several events.
struct CanFrame {
  static constexpr EventKind kKind = EventKind::can_frame;
  static constexpr std::size_t kPieceBytes = 16;
  std::uint32_t identifier = 0;  // 11 bits, or 29 bits if `extended`
  std::uint16_t suppressed = 0;  // of all identifiers, before the first piece; 65535: or more
  std::uint8_t length = 0;       // of the frame, 0..64
  bool extended : 1 = false;
  bool remote : 1 = false;  // without data; `length` is the requested length
  bool fd : 1 = false;
  std::uint8_t piece : 2 = 0;                 // 0..3
  std::array<std::byte, kPieceBytes> data{};  // from byte kPieceBytes x piece on

  // Number of bytes used in `data`.
  std::size_t bytes() const {
    const std::size_t before = kPieceBytes * piece;
    const std::size_t left = remote || length <= before ? 0 : length - before;
    return left < kPieceBytes ? left : kPieceBytes;
  }

  friend bool operator==(const CanFrame&, const CanFrame&) = default;
};

// --- the own node --------------------------------------------------------------------------------

// The manager (CiA 302-2) entered another state.
struct ManagerState {
  static constexpr EventKind kKind = EventKind::manager_state;
  manager::ManagerState state{};
  manager::ManagerState before{};

  friend bool operator==(const ManagerState&, const ManagerState&) = default;
};

// NMT state of the own node, or of an own device. node: as configured.
struct OwnState {
  static constexpr EventKind kKind = EventKind::own_state;
  nmt::State state{};
  nmt::State before{};
  std::uint8_t node_id = 0;  // on the bus; by LSS it may differ from `node`

  friend bool operator==(const OwnState&, const OwnState&) = default;
};

// What an EMCY of CANopen FD has beside the fields of a classical one (OWN, see emcy/message.h).
struct FdEmcy {
  bool any = false;                 // false: a classical EMCY
  std::uint8_t logical_device = 0;  // 1..8, 0 = all
  std::uint8_t status = 0;
  std::uint16_t profile = 0;               // number of the CiA profile
  std::array<std::byte, 6> time_of_day{};  // of the error; all 0: not known

  friend bool operator==(const FdEmcy&, const FdEmcy&) = default;
};

// An EMCY of the own node (CiA 301 7.2.7) that the bus acknowledged.
struct EmcySent {
  static constexpr EventKind kKind = EventKind::emcy_sent;
  std::uint16_t code = 0;           // emergency error code
  std::uint8_t error_register = 0;  // object 1001h
  std::array<std::byte, 5> manufacturer{};
  FdEmcy fd{};

  friend bool operator==(const EmcySent&, const EmcySent&) = default;
};

// No SYNC within 1.5 periods.
struct SyncLost {
  static constexpr EventKind kKind = EventKind::sync_lost;
  std::chrono::microseconds period{};  // communication cycle period, object 1006h

  friend bool operator==(const SyncLost&, const SyncLost&) = default;
};

// Another device has the own node's node-ID.
struct DuplicateNodeId {
  static constexpr EventKind kKind = EventKind::duplicate_node_id;
  nmt::State state{};  // in its heartbeat; initialising: its boot-up message; unknown: its EMCY

  friend bool operator==(const DuplicateNodeId&, const DuplicateNodeId&) = default;
};

// An object that is not in the image was written over SDO or MPDO, of an own device or, with node
// 0, of own_objects of the own node. Of more than 8 writes in a second the newest one is reported.
struct ObjectWritten {
  static constexpr EventKind kKind = EventKind::object_written;
  std::uint32_t size = 0;  // bytes of the value
  std::uint32_t suppressed = 0;
  std::uint16_t index = 0;
  std::uint8_t sub = 0;
  std::array<std::byte, 13> data{};  // first bytes of the value, at most `size` of them

  friend bool operator==(const ObjectWritten&, const ObjectWritten&) = default;
};

// An NMT command reset an own device.
struct OwnReset {
  static constexpr EventKind kKind = EventKind::own_reset;
  nmt::Command command{};  // reset_node or reset_communication

  friend bool operator==(const OwnReset&, const OwnReset&) = default;
};

// An own device received a TIME message; at most one event a second.
struct TimeReceived {
  static constexpr EventKind kKind = EventKind::time_received;
  Duration utc{};  // since 1970-01-01

  friend bool operator==(const TimeReceived&, const TimeReceived&) = default;
};

// --- nodes ---------------------------------------------------------------------------------------

// Boot-up message (CiA 301 7.2.8.3.3) of node.
struct BootUp {
  static constexpr EventKind kKind = EventKind::boot_up;

  friend bool operator==(const BootUp&, const BootUp&) = default;
};

// NMT state of node from its error control.
struct NodeState {
  static constexpr EventKind kKind = EventKind::node_state;
  nmt::State state{};
  nmt::State before{};

  friend bool operator==(const NodeState&, const NodeState&) = default;
};

enum class ErrorControl : std::uint8_t {
  heartbeat,
  node_guarding,  // of node
  life_guarding,  // of the own node, by its master
};

// The error control of node detected a loss.
struct HeartbeatLost {
  static constexpr EventKind kKind = EventKind::heartbeat_lost;
  ErrorControl by = ErrorControl::heartbeat;
  std::chrono::milliseconds time{};  // consumer heartbeat time, or life time

  friend bool operator==(const HeartbeatLost&, const HeartbeatLost&) = default;
};

// The first heartbeat after a loss.
struct HeartbeatRecovered {
  static constexpr EventKind kKind = EventKind::heartbeat_recovered;
  nmt::State state{};

  friend bool operator==(const HeartbeatRecovered&, const HeartbeatRecovered&) = default;
};

// manager::BootFinding::Kind.
enum class BootCause : std::uint8_t {
  none,     // only the letter
  abort,    // the transfer of the object ended with `abort`
  value,    // the object is `found`, which is not `expected`
  written,  // the object was written last
};

// The boot slave process (CiA 302-2) of node ended.
struct BootResult {
  static constexpr EventKind kKind = EventKind::boot_result;
  char letter = '\0';  // manager::NodeState::boot
  BootCause cause = BootCause::none;
  std::uint8_t sub = 0;  // of the object; 0 without a cause, like the following members
  std::uint16_t index = 0;
  AbortCode abort = AbortCode::none;
  std::uint32_t found = 0;
  // If a communication error counted as a refusal: the number of consecutive aborts.
  std::uint32_t expected = 0;

  friend bool operator==(const BootResult&, const BootResult&) = default;
};

// An EMCY (CiA 301 7.2.7) of node.
struct Emcy {
  static constexpr EventKind kKind = EventKind::emcy;
  std::uint16_t code = 0;           // emergency error code
  std::uint8_t error_register = 0;  // object 1001h
  std::array<std::byte, 5> manufacturer{};
  FdEmcy fd{};

  friend bool operator==(const Emcy&, const Emcy&) = default;
};

// A configured object could not be written, or a PDO or the stored parameters of the own node
// (index 1010h) cannot be used.
struct ConfigurationError {
  static constexpr EventKind kKind = EventKind::configuration_error;
  AbortCode abort = AbortCode::none;
  std::uint16_t index = 0;
  std::uint8_t sub = 0;

  friend bool operator==(const ConfigurationError&, const ConfigurationError&) = default;
};

// A node that is not configured.
struct UnexpectedNode {
  static constexpr EventKind kKind = EventKind::unexpected_node;
  nmt::State state{};  // initialising: its boot-up message

  friend bool operator==(const UnexpectedNode&, const UnexpectedNode&) = default;
};

// A node left Operational, or booted, without an NMT command.
struct SpontaneousChange {
  static constexpr EventKind kKind = EventKind::spontaneous_change;
  nmt::State state{};  // initialising: its boot-up message
  nmt::State before{};

  friend bool operator==(const SpontaneousChange&, const SpontaneousChange&) = default;
};

enum class SharedIdEvidence : std::uint8_t {
  none,                     // in no event
  two_responses,            // to one SDO request
  two_states,               // heartbeats with alternating NMT states
  two_periods,              // heartbeats with two periods
  unchanged_after_boot_up,  // heartbeats that continue after a boot-up message
  too_many_heartbeats,      // twice as many as 1017h of the node allows
};

// Two devices have the node-ID of node.
struct SharedNodeId {
  static constexpr EventKind kKind = EventKind::shared_node_id;
  SharedIdEvidence evidence = SharedIdEvidence::none;
  std::uint8_t sub = 0;  // the object of the SDO request; else 0
  std::uint16_t index = 0;

  friend bool operator==(const SharedNodeId&, const SharedNodeId&) = default;
};

// A scan has read the identification objects of node.
struct NodeScanned {
  static constexpr EventKind kKind = EventKind::node_scanned;
  AbortCode abort = AbortCode::none;  // ended the scan early
  std::uint32_t objects = 0;          // number of objects that were read

  friend bool operator==(const NodeScanned&, const NodeScanned&) = default;
};

// Result of LSS for a device without a node-ID. node: the configured node, 0 = unknown.
struct LssResult {
  static constexpr EventKind kKind = EventKind::lss_result;
  lss::Verdict verdict{};
  std::uint8_t error = 0;                                 // error code of the device
  std::uint8_t specific = 0;                              // its specific error code
  std::optional<std::array<std::uint32_t, 4>> address{};  // lss::Address

  friend bool operator==(const LssResult&, const LssResult&) = default;
};

// --- PDO and SDO ---------------------------------------------------------------------------------

// A PDO has another length than its mapping. node: its sender.
struct PdoLength {
  static constexpr EventKind kKind = EventKind::pdo_length;
  std::uint16_t number = 0;   // of the RPDO, from 1
  std::uint16_t mapped = 0;   // bytes
  std::uint8_t received = 0;  // bytes

  friend bool operator==(const PdoLength&, const PdoLength&) = default;
};

// The deadline of an RPDO passed. node: its sender.
struct PdoTimeout {
  static constexpr EventKind kKind = EventKind::pdo_timeout;
  std::uint16_t number = 0;              // of the RPDO, from 1
  std::chrono::milliseconds deadline{};  // event timer, sub-index 5 of 1400h

  friend bool operator==(const PdoTimeout&, const PdoTimeout&) = default;
};

// The first reception after PdoTimeout. node: its sender.
struct PdoRecovered {
  static constexpr EventKind kKind = EventKind::pdo_recovered;
  std::uint16_t number = 0;  // of the RPDO, from 1

  friend bool operator==(const PdoRecovered&, const PdoRecovered&) = default;
};

// Another SDO client uses the default SDO server of node.
struct ForeignSdo {
  static constexpr EventKind kKind = EventKind::foreign_sdo;
  std::uint32_t identifier = 0;  // of its response

  friend bool operator==(const ForeignSdo&, const ForeignSdo&) = default;
};

// An SDO transfer with node was aborted. An observer reports it at most once a second per node,
// code and object.
struct SdoAbort {
  static constexpr EventKind kKind = EventKind::sdo_abort;
  AbortCode abort = AbortCode::none;
  std::uint16_t index = 0;
  std::uint8_t sub = 0;
  std::uint32_t suppressed = 0;

  friend bool operator==(const SdoAbort&, const SdoAbort&) = default;
};

// --- outputs and commands ------------------------------------------------------------------------

// An OutputWrite was refused.
struct OutputRefused {
  static constexpr EventKind kKind = EventKind::output_refused;
  line::OutputRefusal refusal{};
  std::uint16_t group = 0;
  std::uint32_t suppressed = 0;
  std::uint32_t client = 0;

  friend bool operator==(const OutputRefused&, const OutputRefused&) = default;
};

// The first write of a group, which starts its watchdog.
struct OutputArmed {
  static constexpr EventKind kKind = EventKind::output_armed;
  std::uint16_t group = 0;
  std::chrono::milliseconds watchdog{};  // 0 = none
  std::uint32_t client = 0;

  friend bool operator==(const OutputArmed&, const OutputArmed&) = default;
};

// The watchdog of a group expired.
struct OutputWatchdog {
  static constexpr EventKind kKind = EventKind::output_watchdog;
  std::uint16_t group = 0;
  // line::kZeroOutputs ..., those that were carried out: NMT commands and an EMCY if they are sent
  // or queued
  std::uint8_t reactions = 0;

  friend bool operator==(const OutputWatchdog&, const OutputWatchdog&) = default;
};

// A command was refused. node: that of the command.
struct CommandRefused {
  static constexpr EventKind kKind = EventKind::command_refused;
  line::Refusal refusal{};
  line::CommandKind command{};
  std::uint32_t suppressed = 0;
  std::uint32_t client = 0;

  friend bool operator==(const CommandRefused&, const CommandRefused&) = default;
};

// A command that changes something was accepted: see line::Command::audited. node: that of the
// command, 0 = all or none. The result is in the reply.
struct CommandAccepted {
  static constexpr EventKind kKind = EventKind::command_accepted;
  line::CommandKind command{};
  std::uint8_t sub = 0;
  std::uint16_t index = 0;  // of the object, for commands that write one; else 0
  std::uint32_t client = 0;
  std::uint32_t suppressed = 0;

  friend bool operator==(const CommandAccepted&, const CommandAccepted&) = default;
};

// Another client writes a group of outputs that was in use.
struct OutputOwner {
  static constexpr EventKind kKind = EventKind::output_owner;
  std::uint16_t group = 0;
  std::uint32_t client = 0;
  std::uint32_t before = 0;  // the client that wrote it before
  std::uint32_t suppressed = 0;

  friend bool operator==(const OutputOwner&, const OutputOwner&) = default;
};

// A client exceeds its share of the bus, see line::RequestBudget. Counts since its last such event.
struct ClientLimited {
  static constexpr EventKind kKind = EventKind::client_limited;
  std::uint32_t client = 0;
  std::uint32_t delayed = 0;   // commands that waited for the share
  std::uint32_t refused = 0;   // commands refused as busy
  std::uint32_t replaced = 0;  // output writes that waited when a newer one came

  friend bool operator==(const ClientLimited&, const ClientLimited&) = default;
};

// Progress of a long command. node: 0 = several nodes.
struct CommandProgress {
  static constexpr EventKind kKind = EventKind::command_progress;
  line::CommandKind command{};  // configure: objects, program: bytes, lss: parts of an address
  std::uint32_t done = 0;
  std::uint32_t total = 0;  // 0 = unknown

  friend bool operator==(const CommandProgress&, const CommandProgress&) = default;
};

// --- traffic of other nodes, received by an observer ---------------------------------------------

// An NMT command. node: its addressee, 0 = all.
struct NmtCommand {
  static constexpr EventKind kKind = EventKind::nmt_command;
  nmt::Command command{};

  friend bool operator==(const NmtCommand&, const NmtCommand&) = default;
};

// An SDO transfer with the server of node completed. Reported at most once a second per node,
// object and direction.
struct SdoTransfer {
  static constexpr EventKind kKind = EventKind::sdo_transfer;
  std::uint32_t size = 0;        // bytes of the value
  std::uint16_t suppressed = 0;  // 65535: or more
  std::uint16_t index = 0;
  std::uint8_t sub = 0;
  bool download = false;             // written, else read
  std::array<std::byte, 13> data{};  // first bytes of the value, at most `size` of them

  friend bool operator==(const SdoTransfer&, const SdoTransfer&) = default;
};

// The known parameters of a PDO of node changed.
struct PdoMapping {
  static constexpr EventKind kKind = EventKind::pdo_mapping;
  std::uint16_t number = 0;  // of the PDO, from 1
  pdo::PdoKind kind{};       // as the node names it
  bool complete = false;     // its mapping is known completely

  friend bool operator==(const PdoMapping&, const PdoMapping&) = default;
};

enum class ManagerEvidence : std::uint8_t {
  nmt_command = 1,
  flying_master = 2,  // a message of flying masters, CiA 302-2
  sleep = 3,          // it prepares the nodes for sleep, which take no outputs from then on
};

// Another NMT master is on the line; repeated every 10 s while it is active.
struct ForeignManager {
  static constexpr EventKind kKind = EventKind::foreign_manager;
  ManagerEvidence evidence = ManagerEvidence::nmt_command;
  nmt::Command command{};        // nmt_command
  std::uint8_t addressee = 0;    // nmt_command: its node-ID, 0 = all
  std::uint32_t identifier = 0;  // flying_master, sleep: of the message

  friend bool operator==(const ForeignManager&, const ForeignManager&) = default;
};

// --- other networks (CiA 302-7) ------------------------------------------------------------------

// A request from or to another network was refused.
struct RoutingRefused {
  static constexpr EventKind kKind = EventKind::routing_refused;
  AbortCode abort = AbortCode::none;
  std::uint16_t source = 0;  // network-ID, 0 = this process
  std::uint16_t target = 0;  // network-ID
  std::uint8_t target_node = 0;
  routing::RoutedService service{};

  friend bool operator==(const RoutingRefused&, const RoutingRefused&) = default;
};

// An EMCY of another network. node: its sender on this line, 0 = this line's own node.
struct EmcyRouted {
  static constexpr EventKind kKind = EventKind::emcy_routed;
  std::uint16_t code = 0;    // emergency error code
  std::uint16_t source = 0;  // network-ID
  std::uint8_t source_node = 0;
  std::uint8_t error_register = 0;  // object 1001h
  std::uint8_t hops = 0;
  std::uint8_t number = 0;

  friend bool operator==(const EmcyRouted&, const EmcyRouted&) = default;
};

// A connection to another network, of a client on the line or of this process through the line.
// Emitted only while CommandKind::routing_trace is active, for at most 50 connections a second.
struct RoutingOpened {
  static constexpr EventKind kKind = EventKind::routing_opened;
  std::uint32_t connection = 0;  // its number
  std::uint32_t suppressed = 0;  // connections that were not reported before
  std::uint16_t source = 0;      // network-ID, 0 = this process
  std::uint16_t target = 0;      // network-ID
  std::uint8_t target_node = 0;
  std::uint8_t interface = 0;  // number of the outgoing interface
  std::uint8_t gateway = 0;    // node-ID of the next gateway there, 0 = none
  std::uint8_t hops = 0;

  friend bool operator==(const RoutingOpened&, const RoutingOpened&) = default;
};

// SDO service of the last transfer of a connection.
enum class SdoService : std::uint8_t { none, upload, download };

// The end of a connection of RoutingOpened.
struct RoutingEnded {
  static constexpr EventKind kKind = EventKind::routing_ended;
  std::uint32_t connection = 0;
  AbortCode abort = AbortCode::none;  // none: completed
  std::uint32_t bytes = 0;            // transferred
  std::uint16_t source = 0;           // as in RoutingOpened
  std::uint16_t target = 0;
  std::uint16_t index = 0;  // of the object
  std::uint8_t sub = 0;
  std::uint8_t target_node = 0;
  std::uint8_t interface = 0;
  std::uint8_t gateway = 0;
  SdoService service = SdoService::none;

  friend bool operator==(const RoutingEnded&, const RoutingEnded&) = default;
};

// A write to another network was passed to another gateway, which did not answer in time, or with
// no certain result: it may have been carried out. Limited for each object.
struct RoutingUnanswered {
  static constexpr EventKind kKind = EventKind::routing_unanswered;
  std::uint32_t suppressed = 0;
  std::uint16_t source = 0;  // network-ID, 0 = this process
  std::uint16_t target = 0;  // network-ID
  std::uint16_t index = 0;   // of the object
  std::uint8_t sub = 0;
  std::uint8_t target_node = 0;
  std::uint8_t interface = 0;  // number of the way, see routing::Interface

  friend bool operator==(const RoutingUnanswered&, const RoutingUnanswered&) = default;
};

// --- sleep ---------------------------------------------------------------------------------------

// The line entered another phase of sleep. node: that objected, if it did; else 0.
struct SleepState {
  static constexpr EventKind kKind = EventKind::sleep_state;
  nmt::SleepPhase phase{};
  nmt::SleepPhase before{};
  nmt::SleepCause cause{};

  friend bool operator==(const SleepState&, const SleepState&) = default;
};

// --- SRDOs ---------------------------------------------------------------------------------------

// The safety state of an SRDO that the node transmits changed (EN 50325-5). Limited for each SRDO.
struct SrdoState {
  static constexpr EventKind kKind = EventKind::srdo_state;
  std::uint32_t suppressed = 0;
  srdo::Fault fault{};      // Fault::none: the SRDO is valid
  std::uint8_t number = 0;  // of the node's SRDO, 1..64

  friend bool operator==(const SrdoState&, const SrdoState&) = default;
};

// --- SDO connections
// --------------------------------------------------------------------------------

enum class ConnectionResult : std::uint8_t {
  opened = 0,   // both records are valid
  closed = 1,   // released on request, or because the line stopped
  failed = 2,   // it could not be opened
  lost = 3,     // released because one of its nodes booted
  stale = 4,    // a record could not be set to not valid
  cleared = 5,  // the record of a stale connection is not valid any more
};

// An SDO connection that the manager assigns (CiA 302-5) was opened, or ended. node: that of the
// client.
struct SdoConnection {
  static constexpr EventKind kKind = EventKind::sdo_connection;
  std::uint32_t number = 0;
  AbortCode abort = AbortCode::none;  // of failed and stale
  std::uint16_t client_record = 0;    // object, 0 = none was found
  std::uint16_t server_record = 0;
  std::uint16_t request = 0;  // CAN-ID from client to server, 0 = none was assigned
  std::uint16_t response = 0;
  std::uint8_t client = 0;  // node-ID
  std::uint8_t server = 0;
  ConnectionResult result = ConnectionResult::opened;

  friend bool operator==(const SdoConnection&, const SdoConnection&) = default;
};

// --- the gateway, which belongs to no line -------------------------------------------------------

// The gateway started.
struct GatewayStarted {
  static constexpr EventKind kKind = EventKind::gateway_started;
  std::uint32_t lines = 0;

  friend bool operator==(const GatewayStarted&, const GatewayStarted&) = default;
};

// A reload was carried out.
struct GatewayReloaded {
  static constexpr EventKind kKind = EventKind::gateway_reloaded;
  std::uint32_t changed = 0;  // lines that were started, stopped or replaced
  std::uint32_t lines = 0;    // lines now

  friend bool operator==(const GatewayReloaded&, const GatewayReloaded&) = default;
};

// A reload was refused; everything runs as before.
struct GatewayReloadRefused {
  static constexpr EventKind kKind = EventKind::gateway_reload_refused;
  std::uint32_t errors = 0;

  friend bool operator==(const GatewayReloadRefused&, const GatewayReloadRefused&) = default;
};

enum class JournalCondition : std::uint8_t {
  working = 1,  // stores events, again
  failing = 2,  // events cannot be stored
  renewed = 3,  // a new file, or a new stream of event numbers
};

// The journal of events entered another condition.
struct JournalState {
  static constexpr EventKind kKind = EventKind::journal_state;
  JournalCondition condition = JournalCondition::working;
  std::uint32_t error = 0;  // extended result code of SQLite; 0 = none
  std::uint32_t lost = 0;   // number of events that are missing in the journal since the last one

  friend bool operator==(const JournalState&, const JournalState&) = default;
};

enum class ProcessEnd : std::uint8_t {
  exited = 1,       // by itself
  signal = 2,       // of the system or of another process
  no_response = 3,  // was ended: it did not respond
  malformed = 4,    // was ended: it sent what no working process sends
  memory = 5,       // it used up its memory
  not_started = 6,  // the system refused to start it
};

enum class DdsProcess : std::uint8_t {
  endpoints = 0,  // has the DDS endpoints of the gateway
  routes = 1,     // sends requests to other gateways, and receives their EMCYs
};

// A process with DDS ended and is started again.
struct DdsProcessEnded {
  static constexpr EventKind kKind = EventKind::dds_process_ended;
  ProcessEnd cause = ProcessEnd::exited;
  std::uint32_t detail = 0;    // exit code, number of the signal, or error number of the system
  std::uint32_t ends = 1;      // since the last one of these events, with this one
  std::uint32_t pause_ms = 0;  // before the next start
  DdsProcess process = DdsProcess::endpoints;

  friend bool operator==(const DdsProcessEnded&, const DdsProcessEnded&) = default;
};

// The own node as a flying master (CiA 302-2) changed its state, or another master is the active
// one. node: the active master, 0 = not known.
struct FlyingMaster {
  static constexpr EventKind kKind = EventKind::flying_master;
  nmt::FlyingMasterState state{};
  nmt::FlyingMasterState before{};
  std::uint8_t priority = 0;  // of the own node, 0..2; 0 is the highest

  friend bool operator==(const FlyingMaster&, const FlyingMaster&) = default;
};

}  // namespace event

// In the order of EventKind.
using EventData = std::variant<
    event::LineStarted, event::LineStopped, event::BusState, event::BusError, event::FramesLost,
    event::InterfaceFailed, event::InterfaceReady, event::ManagerState, event::OwnState,
    event::BootUp, event::NodeState, event::HeartbeatLost, event::HeartbeatRecovered,
    event::BootResult, event::Emcy, event::EmcySent, event::ConfigurationError, event::PdoLength,
    event::PdoTimeout, event::PdoRecovered, event::SyncLost, event::MalformedFrame,
    event::UnexpectedNode, event::ForeignSdo, event::SdoAbort, event::OutputRefused,
    event::OutputArmed, event::OutputWatchdog, event::CommandRefused, event::EventsLost,
    event::ClockStep, event::QueueFull, event::DuplicateNodeId, event::NmtCommand,
    event::SdoTransfer, event::PdoMapping, event::LayoutChanged, event::RoutingRefused,
    event::EmcyRouted, event::RoutingOpened, event::RoutingEnded, event::NodeScanned,
    event::CommandProgress, event::LssResult, event::ForeignManager, event::CanFrame,
    event::GatewayStarted, event::GatewayReloaded, event::GatewayReloadRefused,
    event::SpontaneousChange, event::SharedNodeId, event::ObjectWritten, event::OwnReset,
    event::TimeReceived, event::CommandAccepted, event::OutputOwner, event::ClientLimited,
    event::JournalState, event::DdsProcessEnded, event::RoutingUnanswered, event::SrdoState,
    event::SdoConnection, event::FlyingMaster, event::SleepState>;

inline constexpr std::size_t kEventKinds = std::variant_size_v<EventData>;

// The kind of each alternative.
inline constexpr auto kKindsOfEventData =
    []<class... Kinds>(std::type_identity<std::variant<Kinds...>>) {
      static_assert((std::is_trivially_copyable_v<Kinds> && ...));
      static_assert(((sizeof(Kinds) <= 24) && ...));
      return std::array{Kinds::kKind...};
    }(std::type_identity<EventData>{});
static_assert(
    [] {
      for (std::size_t i = 0; i < kKindsOfEventData.size(); ++i) {
        if (static_cast<std::size_t>(kKindsOfEventData[i]) != i) {
          return false;
        }
      }
      return true;
    }(),
    "the alternatives of EventData are in the order of EventKind");
static_assert(std::is_trivially_copyable_v<EventData>);

inline EventKind kind(const EventData& data) {
  return static_cast<EventKind>(data.index());
}
// Data of that kind with default members. Precondition: a kind below kEventKinds.
EventData empty_event_data(EventKind kind);

}  // namespace linegate
