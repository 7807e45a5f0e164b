// SPDX-License-Identifier: Apache-2.0
// The requests to a line: a struct for each kind of command, with its parameters. The line checks
// the ranges that the types do not enforce, and refuses other values with Refusal::bad_request.
#pragma once

#include <algorithm>
#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>
#include <variant>
#include <vector>

#include "stack/can/frame.h"
#include "stack/line/own_object.h"
#include "stack/lss/procedure.h"
#include "stack/nmt/state.h"
#include "stack/od/description.h"

namespace linegate::line {

// Append only: the numbers are those of the DDS contract. Names, access rules and counters use it;
// the parameters are in the alternatives of Request. The numbers that are left out are commands
// that the owner of the lines executes; it may report their events with Line::report().
enum class CommandKind : std::uint8_t {
  sdo_read = 0,
  sdo_write = 1,
  local_read = 2,
  local_write = 3,
  output_write = 4,
  emcy_send = 5,
  nmt = 6,
  network_read = 8,
  network_write = 9,
  routing_trace = 11,
  scan = 12,
  boot = 14,
  configure = 15,
  program = 16,
  lss = 17,
  object_write = 18,
  pdo_trigger = 19,
  can_send = 20,
  can_listen = 21,
  object_create = 22,
  scan_apply = 23,
  pdo_request = 24,
  mpdo_write = 25,
  connection_open = 27,
  connection_close = 28,
  connection_list = 29,
  sleep = 30,
};
// "sdo-read"
std::string_view name(CommandKind kind);

// --- objects of devices --------------------------------------------------------------------------

// Reads an object of a device (CiA 301 7.2.4). With the own node's ID like LocalRead.
struct SdoRead {
  static constexpr CommandKind kKind = CommandKind::sdo_read;
  std::uint8_t node = 0;  // 1..127
  od::Address address{};
  // A value in the image of the inputs that is valid and in time may answer the command.
  bool from_image = false;
  // A value that a scan read of the object may answer the command.
  bool from_scan = false;
  // How often the transfer is repeated if it ended because a frame was lost: with abort
  // 0503 0000h, 0504 0000h, 0504 0003h or 0504 0004h of either side. Each attempt waits for a
  // response no longer than its share of Command::timeout. The reply is that of the last attempt.
  std::uint8_t repeats = 0;
};

struct SdoWrite {
  static constexpr CommandKind kKind = CommandKind::sdo_write;
  std::uint8_t node = 0;  // 1..127
  od::Address address{};
  std::vector<std::byte> data{};  // little-endian, at least 1 byte
  std::uint8_t repeats = 0;       // as in SdoRead
};

// Reads an object of a device in another network (CiA 302-7), by the cheapest route of 1F2Ch;
// within the line's own network like SdoRead.
struct NetworkRead {
  static constexpr CommandKind kKind = CommandKind::network_read;
  std::uint16_t network = 0;  // network-ID, 1..65535
  std::uint8_t node = 0;      // 1..127
  od::Address address{};
  // The line treats the request as that of a device on its bus. It comes from the line's network,
  // so the access rules of the line that it enters apply, in addition to those of this process; no
  // route leads back over this line.
  bool as_device = false;
  std::uint8_t repeats = 0;  // as in SdoRead
  // The number of gateways that the request has passed, see routing::Config::hop_limit
  std::uint8_t hops = 0;
};

struct NetworkWrite {
  static constexpr CommandKind kKind = CommandKind::network_write;
  std::uint16_t network = 0;  // network-ID, 1..65535
  std::uint8_t node = 0;      // 1..127
  od::Address address{};
  bool as_device = false;         // as in NetworkRead
  std::vector<std::byte> data{};  // little-endian, at least 1 byte
  std::uint8_t repeats = 0;       // as in SdoRead
  std::uint8_t hops = 0;          // as in NetworkRead
};

// Writes an object by PDO if a PDO of the line carries it, else by SDO like SdoWrite (CANopenIA
// manual 5.1). By PDO refused as SingleOutput. Reply: WrittenByPdo or WrittenBySdo; no data for an
// object of the own node.
struct ObjectWrite {
  static constexpr CommandKind kKind = CommandKind::object_write;
  std::uint8_t node = 0;  // 1..127
  od::Address address{};
  std::vector<std::byte> data{};  // little-endian; by PDO exactly as long as the entry
  bool force_sdo = false;         // by SDO, whatever PDOs map
  bool keep_pdo = false;          // do not request the PDO: PdoTrigger does
};

// --- objects of the own dictionary ---------------------------------------------------------------

// All objects from first to last.
struct ObjectRange {
  std::uint16_t first = 0;
  std::uint16_t last = 0xFFFF;
};

// Reads an object of the own dictionary, or a list of objects. Reply: the value, or ListedObjects.
struct LocalRead {
  static constexpr CommandKind kKind = CommandKind::local_read;
  // Role device: the device, 0 = the only one. Else for a list: 0 = the own dictionary, or the node
  // whose device file, values included, is listed; bad_request if it is not configured with one.
  std::uint8_t node = 0;
  std::variant<od::Address, ObjectRange> what{};
};

struct LocalWrite {
  static constexpr CommandKind kKind = CommandKind::local_write;
  std::uint8_t node = 0;  // role device: the device, 0 = the only one
  od::Address address{};
  // Role device: writes as the device itself, whatever the access of the object. Only for 1002h,
  // 1008h to 100Ah and 2000h to 9FFFh.
  bool as_owner = false;
  std::vector<std::byte> data{};  // little-endian
};

struct ObjectRemoval {
  std::uint16_t index = 0;  // all sub-indices that commands created
};

// Creates or removes an application object in the own dictionary. It exists until the line is
// stopped (IXXAT CANopen Manager API manual 5.15).
struct ObjectCreate {
  static constexpr CommandKind kKind = CommandKind::object_create;
  std::variant<OwnObject, ObjectRemoval> what{};
};

// --- process data --------------------------------------------------------------------------------

// Writes one output value by hand. wrong_state while its node is not Operational, or from the
// reaction of its group's watchdog until the next OutputWrite of the group. Reply: WrittenByPdo; no
// data if no PDO or MPDO carries the entry.
struct SingleOutput {
  static constexpr CommandKind kKind = CommandKind::output_write;
  std::uint32_t entry = 0;        // of the output layout
  std::vector<std::byte> data{};  // little-endian, exactly as long as the entry
};

// Sends PDOs although nothing changed, as soon as inhibit time and SYNC permit (CANopenIA manual
// 5F01h:0Ch, IXXAT CANopen Manager API manual 6.1.6). Reply: TriggeredPdos.
struct PdoTrigger {
  static constexpr CommandKind kKind = CommandKind::pdo_trigger;
  // 1..127: the PDO that is RPDO `number` of this node; 0: the own TPDO `number`. Role device: TPDO
  // `number` of this device, 0 = the only one.
  std::uint8_t node = 0;
  std::uint16_t number = 0;  // 1..512, higher for PDOs without an object
  // Instead of both: all PDOs that carry this byte of the outputs.
  std::optional<std::uint32_t> output_byte{};
};

// Requests a TPDO of a device with a remote frame (CiA 301 7.2.2.3.2). Answered when the PDO was
// received; timed_out after Command::timeout, or else LineConfig::sdo_timeout. bad_request: bit 30
// of its COB-ID does not allow RTR.
struct PdoRequest {
  static constexpr CommandKind kKind = CommandKind::pdo_request;
  // 1..127: TPDO `number` of this device; 0: the PDO that is RPDO `number` of the own node.
  std::uint8_t node = 0;
  std::uint16_t number = 0;  // from 1
};

// Writes an object by an MPDO in destination address mode (CiA 301 7.5.2.35). Answered when the bus
// acknowledged the frame. Reply: SentByMpdo. unknown_entry: there is no such TPDO.
struct MpdoWrite {
  static constexpr CommandKind kKind = CommandKind::mpdo_write;
  std::uint8_t node = 0;  // 1..127, 0 = all
  od::Address address{};
  std::vector<std::byte> data{};  // 1 to 4 bytes, little-endian
  std::uint16_t tpdo = 0;         // number of the own TPDO, 0 = the first in that mode
};

// --- the network ---------------------------------------------------------------------------------

// Sends an NMT command (CiA 301 7.2.8.2.1). Answered when the bus acknowledged the frame.
struct NmtRequest {
  static constexpr CommandKind kKind = CommandKind::nmt;
  std::uint8_t node = 0;  // 1..127, 0 = all
  nmt::Command command = nmt::Command::start;
};

// Sends an EMCY of the own node (CiA 301 7.2.7).
struct EmcySend {
  static constexpr CommandKind kKind = CommandKind::emcy_send;
  std::uint8_t node = 0;   // role device: the device, 0 = the only one
  std::uint16_t code = 0;  // emergency error code
  std::uint8_t error_register = 0;
  std::array<std::byte, 5> manufacturer{};
};

// Reads the identity and the PDOs that the devices report; writes nothing to them. Role manager,
// one at a time; emits an event for each node meanwhile. Reply: a ScannedNode of each
// node.
struct Scan {
  static constexpr CommandKind kKind = CommandKind::scan;
  std::uint8_t node = 0;  // 1..127, 0 = all except the own node
};

// Like Scan, but the result becomes the configuration of the line, which is made anew with it. Only
// if no nodes are configured, or nodes that a scan found.
struct ScanApply {
  static constexpr CommandKind kKind = CommandKind::scan_apply;
  std::uint8_t node = 0;  // 1..127, 0 = all except the own node
  // Configures error control and the analogue inputs of CiA 401 on devices where they are not
  // configured (scan/describe.h). Without it nothing is written to a device, not even when it
  // boots.
  bool set_up = false;
  // Devices restore their defaults (1011h:1) and are reset before they are read.
  bool restore = false;
};

// Repeats the boot process (CiA 302-2), which begins with NMT reset communication unless the node
// is to be kept alive. Role manager; emits an event for each result meanwhile. An absent node ends
// with B when its boot time-out has passed. Reply: a BootOutcome of each node.
struct Boot {
  static constexpr CommandKind kKind = CommandKind::boot;
  std::uint8_t node = 0;  // 1..127, 0 = all of the network list
};

// Compares a node with its configuration (CiA 302-3), or boots it again and configures it.
// Role manager, one at a time; EventKind::command_progress each second. Reply: a NodeReport of each
// node.
struct Configure {
  static constexpr CommandKind kKind = CommandKind::configure;
  std::uint8_t node = 0;  // 1..127, 0 = all
  bool apply = false;     // boot and configure, else compare
};

enum class SleepAction : std::uint8_t {
  check,    // asks all nodes whether one objects
  sleep,    // check, then prepare unless a node objects
  prepare,  // without a check
  wake,
  object,   // the own node objects to sleep from now on
  consent,  // no more
};
inline constexpr std::size_t kSleepActions = 6;

// Sleep of all nodes (nmt/sleep.h). Only NMT masters check and prepare. Reply to check and sleep:
// the node-IDs of the nodes that object, ascending.
struct SleepRequest {
  static constexpr CommandKind kKind = CommandKind::sleep;
  SleepAction action = SleepAction::check;
};

// Loads a program into a node (CiA 302-3). Role manager; EventKind::command_progress each second.
// Reply to a failed download: ProgramFault.
struct ProgramDownload {
  static constexpr CommandKind kKind = CommandKind::program;
  std::uint8_t node = 0;             // 1..127
  std::uint8_t number = 0;           // of the program (1F50h), from 1
  std::vector<std::byte> program{};  // 1..manager::kLongestProgram bytes
};

// A service of CiA 305. Role manager, one at a time. Reply: stack/lss/procedure.h.
struct LssRequest {
  static constexpr CommandKind kKind = CommandKind::lss;
  lss::Procedure procedure = lss::Procedure::switch_global;
  std::vector<std::byte> arguments{};
};

// --- frames and diagnosis ------------------------------------------------------------------------

// Sends a frame that belongs to no CANopen service (CANopenIA manual 6.2).
// Refusal::identifier_in_use if a service of the line uses its identifier.
struct CanSend {
  static constexpr CommandKind kKind = CommandKind::can_send;
  can::Frame frame{};  // a remote frame has the length that it requests
};

// Reports frames that no service uses as EventKind::can_frame, at most Listening::kMostASecond each
// second (CANopenIA manual 6.2).
struct CanListen {
  static constexpr CommandKind kKind = CommandKind::can_listen;
  static constexpr std::uint32_t kAllBits = 0x1FFF'FFFF;
  std::uint32_t identifier = 0;    // 11 or 29 bits
  std::uint32_t mask = kAllBits;   // the bits of it that are compared
  std::optional<bool> extended{};  // only frames with 29-bit, or 11-bit, identifiers; nullopt: both
  std::chrono::seconds duration{};  // 0..Listening::kLongest; 0 = stop
};

// Emits EventKind::routing_opened and routing_ended for a time.
struct RoutingTrace {
  static constexpr CommandKind kKind = CommandKind::routing_trace;
  std::chrono::seconds duration{};  // 1..routing::Trace::kLongest
};

// --- SDO connections -----------------------------------------------------------------------------

// Assigns an SDO connection (CiA 302-5): writes a free record 1280h to 12FFh of `node` and a free
// record 1201h to 127Fh of `server`, with two CAN-IDs of LineConfig::connection_pool. Role manager.
// wrong_state: there is no pool. Reply: SdoConnections, this one alone. Abort 060A 0023h: no record
// or no CAN-ID is free.
struct ConnectionOpen {
  static constexpr CommandKind kKind = CommandKind::connection_open;
  std::uint8_t node = 0;    // the client, 1..127
  std::uint8_t server = 0;  // 1..127
};

// Releases a connection: its records are set to not valid. Answered with the abort code if one of
// them could not be: the connection is then stale, and can be closed again.
struct ConnectionClose {
  static constexpr CommandKind kKind = CommandKind::connection_close;
  std::uint32_t number = 0;
};

// Reply: SdoConnections, all.
struct ConnectionList {
  static constexpr CommandKind kKind = CommandKind::connection_list;
};

// In the order of CommandKind.
using AnyRequest = std::variant<SdoRead, SdoWrite, LocalRead, LocalWrite, SingleOutput, EmcySend,
                                NmtRequest, NetworkRead, NetworkWrite, RoutingTrace, Scan, Boot,
                                Configure, ProgramDownload, LssRequest, ObjectWrite, PdoTrigger,
                                CanSend, CanListen, ObjectCreate, ScanApply, PdoRequest, MpdoWrite,
                                ConnectionOpen, ConnectionClose, ConnectionList, SleepRequest>;

// One of them. A class, so that not every file that copies or destroys a command compiles that for
// each kind.
struct Request : AnyRequest {
  using AnyRequest::AnyRequest;
  using AnyRequest::operator=;
  Request();
  Request(const Request& from);
  Request(Request&& from) noexcept;
  Request& operator=(const Request& from);
  Request& operator=(Request&& from) noexcept;
  ~Request();
};

// The kind of each alternative.
inline constexpr auto kRequestKinds =
    []<class... Kinds>(std::type_identity<std::variant<Kinds...>>) {
      return std::array{Kinds::kKind...};
    }(std::type_identity<AnyRequest>{});
static_assert(
    [] {
      for (std::size_t i = 1; i < kRequestKinds.size(); ++i) {
        if (kRequestKinds[i - 1] >= kRequestKinds[i]) {
          return false;
        }
      }
      return true;
    }(),
    "the alternatives of Request are in the order of CommandKind");

// Request::index() of a kind, or the number of alternatives if the number is not one of
// CommandKind.
constexpr std::size_t index_of(CommandKind kind) {
  const auto found = std::ranges::lower_bound(kRequestKinds, kind);
  const bool is_one = found != kRequestKinds.end() && *found == kind;
  return is_one ? static_cast<std::size_t>(found - kRequestKinds.begin()) : kRequestKinds.size();
}
inline CommandKind kind(const Request& request) {
  return kRequestKinds[request.index()];
}
// A request of that kind with default parameters. Precondition: kind is one of kRequestKinds.
Request empty_request(CommandKind kind);
// The node of a request, 0 for all nodes or if the kind has no node.
std::uint8_t node_of(const Request& request);

}  // namespace linegate::line
