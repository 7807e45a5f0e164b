// SPDX-License-Identifier: Apache-2.0
// The commands to a line as functions with typed parameters and results, beside sdo_read(),
// sdo_write() and nmt() of Line (client.h, whose rules hold). What they do is in linegate.idl:
// the comment of each names its CommandKind. This header needs the standard library alone.
#pragma once

#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "bridges/client/client.h"

namespace linegate::image {
struct Entry;
}  // namespace linegate::image

namespace linegate::client {

// --- results -------------------------------------------------------------------------------------
// Values of objects are little-endian; SDO abort codes are those of CiA 301, 0 = none. The numbers
// of enumerations are those of the contract; append only.

struct ObjectValue {
  std::uint16_t index = 0;
  std::uint8_t sub = 0;
  std::vector<std::byte> value{};
};

// How a value of an object or output was sent.
struct Delivery {
  enum class Way : std::uint8_t { none, sdo, pdo };
  // What its PDO waits for; sent: the bus acknowledged the frame.
  enum class Wait : std::uint8_t { sent, update_time, values, operational, trigger, turn, bus };
  Way way = Way::none;    // none: an object of the own node, or no PDO carries the output
  std::uint16_t pdo = 0;  // its number on the line
  Wait wait = Wait::sent;
  std::vector<std::uint32_t> missing{};  // values: entries of the output layout never written
};

struct ListedObject {
  std::uint16_t index = 0;
  std::uint8_t sub = 0;
  std::uint16_t type = 0;   // CiA 301 data type
  std::uint8_t access = 0;  // 0 ro, 1 wo, 2 rw, 3 rwr, 4 rww, 5 const
  bool mappable = false;    // PDOs can map it
  bool stored = false;      // by 1010h
  bool application = false;
  std::string name{};
  std::vector<std::byte> value{};  // empty: not readable, or longer than 255 bytes
};

struct ScannedNode {
  std::uint8_t node = 0;
  std::uint32_t abort = 0;  // that ended it early
  std::vector<ObjectValue> values{};
};

struct BootResult {
  enum class Reason : std::uint8_t { none, abort, value, last_written };
  std::uint8_t node = 0;
  char letter = 0;  // error status of CiA 302-2; 0: booted
  Reason reason = Reason::none;
  std::uint16_t index = 0;  // the object that caused the failure
  std::uint8_t sub = 0;
  std::uint32_t abort = 0;
  std::uint32_t expected = 0;
  std::uint32_t found = 0;
  std::string text{};  // in words
  bool ok = false;     // it was booted, or was running
};

struct Difference {
  std::uint16_t index = 0;
  std::uint8_t sub = 0;
  std::uint32_t abort = 0;  // why it could not be read or written
  std::vector<std::byte> expected{};
  std::vector<std::byte> found{};
};

// The configuration of a node, compared or applied.
struct Configuration {
  std::uint8_t node = 0;
  char letter = 0;          // of its boot, as in BootResult
  std::uint32_t abort = 0;  // that ended it
  std::vector<Difference> differences{};
  bool ok = false;  // it is as configured
};

// Of a failed program download: what the device reported.
struct ProgramFault {
  std::uint16_t index = 0;
  std::uint8_t sub = 0;
  std::uint32_t value = 0;
};

// 1018h:1 to 4.
struct LssAddress {
  std::uint32_t vendor = 0;
  std::uint32_t product = 0;
  std::uint32_t revision = 0;
  std::uint32_t serial = 0;
  friend bool operator==(const LssAddress&, const LssAddress&) = default;
};

// A device that assign_node_ids() found.
struct LssAssignment {
  std::uint8_t verdict = 0;  // COMMANDS.md, below COMMAND_LSS
  std::uint8_t node = 0;     // 0: none
  std::uint8_t error = 0;
  std::uint8_t specific_error = 0;
  LssAddress address{};
};

struct LssResult {
  enum class Outcome : std::uint8_t { done, no_response, refused, several, node_id_in_use };
  Outcome outcome = Outcome::no_response;
  std::uint8_t error = 0;  // of a refusal
  std::uint8_t specific_error = 0;
  LssAddress address{};                      // of inquire_address and fastscan
  std::uint8_t node = 0;                     // of inquire_node_id; 255: none
  std::vector<LssAssignment> assignments{};  // of assign_node_ids
  bool ok() const { return outcome == Outcome::done; }
};

struct SdoConnection {
  enum class State : std::uint8_t { opening, open, closing, stale };
  std::uint32_t number = 0;
  std::uint8_t client = 0;  // node-IDs
  std::uint8_t server = 0;
  std::uint16_t client_object = 0;  // 1280h to 12FFh; 0: not found yet
  std::uint16_t server_object = 0;  // 1201h to 127Fh
  std::uint16_t request_id = 0;     // CAN-IDs; 0: not assigned yet
  std::uint16_t response_id = 0;
  State state = State::opening;
  std::uint32_t abort = 0;  // stale: of the write that should have released it
};

// A position in the file of a journal; 0, 0: none.
struct JournalCursor {
  std::uint64_t position = 0;
  std::uint64_t check = 0;
};

struct JournalQuery {
  std::optional<std::string> line{};  // "": the gateway itself
  std::optional<std::uint8_t> node{};
  std::optional<std::uint8_t> kind{};   // EventKind of linegate.idl; not of values
  std::uint8_t severity = 0;            // this one and worse: 0 information, 1 warning, 2 error
  std::string text{};                   // part of the text; of values: name, `*` = any text
  std::optional<std::int64_t> since{};  // inclusive
  std::optional<std::int64_t> until{};  // exclusive
  JournalCursor cursor{};               // of the page before
  bool newest_first = false;
  std::uint32_t most = 0;  // of the page; 0: as many as fit
  bool values = false;     // of the value history, instead of events
};

// From its time on, until the next one of the same line, direction, node and name.
struct HistoryValue {
  std::string line{};
  bool output = false;
  std::uint8_t node = 0;
  std::string name{};
  std::string unit{};
  std::uint16_t type = 0;  // CiA 301 data type
  std::uint16_t bits = 0;  // its size, 1 to 64
  double scale = 1;        // the value in the unit is that of the bits * scale + offset
  double offset = 0;
  std::int64_t time = 0;
  std::optional<std::uint64_t> value{};  // its bits; nothing: no value is valid, or known
};

struct JournalPage {
  std::vector<Event> events{};  // without `gateway` and `name`
  std::vector<HistoryValue> values{};
  JournalCursor cursor{};      // of the next page
  bool more = false;           // the page does not reach the end
  bool unknown_entry = false;  // the gateway stores no entry that fulfils the conditions
};

// A call with a result.
template <class T>
class Answer : public Call {
 public:
  Answer() = default;
  explicit Answer(Call call) : Call(std::move(call)) {}
  // Empty before the call is done, and if it failed; a ProgramFault belongs to a failure.
  T result() const;
};
using Bytes = std::vector<std::byte>;
// In the library.
template <>
std::vector<std::byte> Answer<std::vector<std::byte>>::result() const;
template <>
std::string Answer<std::string>::result() const;
template <>
Delivery Answer<Delivery>::result() const;
template <>
std::vector<ListedObject> Answer<std::vector<ListedObject>>::result() const;
template <>
std::vector<ScannedNode> Answer<std::vector<ScannedNode>>::result() const;
template <>
std::vector<BootResult> Answer<std::vector<BootResult>>::result() const;
template <>
std::vector<Configuration> Answer<std::vector<Configuration>>::result() const;
template <>
ProgramFault Answer<ProgramFault>::result() const;
template <>
std::vector<SdoConnection> Answer<std::vector<SdoConnection>>::result() const;
template <>
std::vector<std::uint16_t> Answer<std::vector<std::uint16_t>>::result() const;
template <>
std::uint16_t Answer<std::uint16_t>::result() const;
template <>
std::vector<std::uint8_t> Answer<std::vector<std::uint8_t>>::result() const;
template <>
LssResult Answer<LssResult>::result() const;
template <>
JournalPage Answer<JournalPage>::result() const;

// --- commands ------------------------------------------------------------------------------------

inline constexpr CallOptions kLong{.timeout = std::chrono::minutes(10)};

// node: 1 to 127; 0 = all where it says so. index: 0 to FFFFh. sub: 0 to 255. A parameter that is
// out of its range is not sent: it refuses the call at once, with REFUSAL_BAD_REQUEST and a text
// that names it and its range, as "node is not 1..127". That is why the types of numbers are wider
// than their ranges: a conversion to them cuts nothing.
class Commands {
 public:
  explicit Commands(Line line) : line_(std::move(line)) {}

  // COMMAND_OBJECT_WRITE: by PDO if one carries the object, else by SDO. by_sdo: by SDO in any
  // case. keep_pdo: the PDO is sent by trigger_pdo().
  Answer<Delivery> write_object(unsigned node, unsigned index, unsigned sub, Bytes value,
                                bool by_sdo = false, bool keep_pdo = false,
                                const CallOptions& options = {}) const;
  // COMMAND_OUTPUT_WRITE: one output, by a person, by its name as in Group::set(), in its unit;
  // raw: as Group::set_raw(). The line must be ready.
  Answer<Delivery> write_output(std::string_view name, const Data& value, bool raw = false,
                                const CallOptions& options = {}) const;
  // COMMAND_NETWORK_READ, COMMAND_NETWORK_WRITE: of a device in another network (CiA 302-7).
  // network: 1 to 65535.
  Answer<Bytes> read_network(unsigned network, unsigned node, unsigned index, unsigned sub,
                             const CallOptions& options = {}) const;
  Call write_network(unsigned network, unsigned node, unsigned index, unsigned sub, Bytes value,
                     const CallOptions& options = {}) const;

  // COMMAND_LOCAL_READ, COMMAND_LOCAL_WRITE: the own object dictionary of the line. node: of a
  // device in role device, 0 = the only one. as_owner: as the device itself, LOCAL_WRITE_OWN.
  Answer<Bytes> read_own(unsigned index, unsigned sub, unsigned node = 0,
                         const CallOptions& options = {}) const;
  Call write_own(unsigned index, unsigned sub, Bytes value, unsigned node = 0,
                 bool as_owner = false, const CallOptions& options = {}) const;
  // node: 0, or the one whose device file is listed.
  Answer<std::vector<ListedObject>> list_objects(unsigned first = 0, unsigned last = 0xFFFF,
                                                 unsigned node = 0,
                                                 const CallOptions& options = {}) const;
  // COMMAND_OBJECT_CREATE: `object` with its default in `value`; `application` has no effect.
  // image_byte: its bytes are those of the image from there on, 0 to FFFFFFFFh. index: 2000h to
  // 5EFFh or 6000h to 9FFFh; sub: 0 to 254; name: up to 255 bytes.
  Call create_object(const ListedObject& object, std::optional<std::uint64_t> image_byte = {},
                     const CallOptions& options = {}) const;
  Call remove_object(unsigned index, const CallOptions& options = {}) const;

  // COMMAND_SCAN, COMMAND_SCAN_APPLY (SCAN_SET_UP, SCAN_RESTORE). node: 0 = all.
  Answer<std::vector<ScannedNode>> scan(unsigned node = 0,
                                        const CallOptions& options = kLong) const;
  Answer<std::vector<ScannedNode>> apply_scan(unsigned node = 0, bool set_up = false,
                                              bool restore = false,
                                              const CallOptions& options = kLong) const;
  // COMMAND_BOOT. node: 0 = all of the network list.
  Answer<std::vector<BootResult>> boot(unsigned node = 0, const CallOptions& options = kLong) const;
  // COMMAND_CONFIGURE, code 0 and 1. node: 0 = all.
  Answer<std::vector<Configuration>> compare(unsigned node = 0,
                                             const CallOptions& options = kLong) const;
  Answer<std::vector<Configuration>> configure(unsigned node = 0,
                                               const CallOptions& options = kLong) const;
  // COMMAND_PROGRAM. number: of the program, 1 to 255. program: 1 byte to 16 MiB.
  Answer<ProgramFault> program(unsigned node, unsigned number, Bytes program,
                               const CallOptions& options = kLong) const;

  // COMMAND_LSS, codes 0 to 11 (CiA 305). The call is done whatever the outcome is.
  Answer<LssResult> lss_switch_global(bool configuration, const CallOptions& options = {}) const;
  Answer<LssResult> lss_switch_selective(const LssAddress& address,
                                         const CallOptions& options = {}) const;
  // node: 1 to 127; 255 = none. unchecked: without the check that no other device uses it.
  Answer<LssResult> lss_set_node_id(unsigned node, bool unchecked = false,
                                    const CallOptions& options = {}) const;
  // table: 0 = that of CiA 305, to 255; index: 0 to 255, in it.
  Answer<LssResult> lss_set_bit_timing(unsigned table, unsigned index,
                                       const CallOptions& options = {}) const;
  // delay: 0 to 65,535 ms.
  Answer<LssResult> lss_activate_bit_timing(std::chrono::milliseconds delay,
                                            const CallOptions& options = {}) const;
  Answer<LssResult> lss_store(const CallOptions& options = {}) const;
  Answer<LssResult> lss_inquire_address(const CallOptions& options = {}) const;
  Answer<LssResult> lss_inquire_node_id(const CallOptions& options = {}) const;
  Answer<LssResult> lss_identify(const LssAddress& lowest, std::uint32_t highest_revision,
                                 std::uint32_t highest_serial,
                                 const CallOptions& options = {}) const;
  Answer<LssResult> lss_identify_unconfigured(const CallOptions& options = {}) const;
  // known: bit 0 vendor, 1 product, 2 revision, 3 serial number of `address` are known.
  Answer<LssResult> lss_fastscan(unsigned known = 0, const LssAddress& address = {},
                                 const CallOptions& options = kLong) const;
  Answer<LssResult> lss_assign_node_ids(const CallOptions& options = kLong) const;

  // COMMAND_PDO_TRIGGER: by the number of the PDO, 1 to 65535, with `node` by that of its RPDO, 1
  // to 512; or all that carry that output. Result: their numbers.
  Answer<std::vector<std::uint16_t>> trigger_pdo(unsigned number, unsigned node = 0,
                                                 const CallOptions& options = {}) const;
  Answer<std::vector<std::uint16_t>> trigger_pdos_of(std::string_view output,
                                                     const CallOptions& options = {}) const;
  // COMMAND_PDO_REQUEST. number: of a TPDO of the node, 1 to 512; node 0: of an RPDO of the own
  // node, 1 to 65535.
  Call request_pdo(unsigned node, unsigned number, const CallOptions& options = {}) const;
  // COMMAND_MPDO_WRITE: 1 to 4 bytes. node 0 = all. tpdo: 1 to 512; 0 = the first in that mode.
  // Result: its number.
  Answer<std::uint16_t> write_mpdo(unsigned node, unsigned index, unsigned sub, Bytes value,
                                   unsigned tpdo = 0, const CallOptions& options = {}) const;
  // COMMAND_EMCY_SEND. code: 0 to FFFFh. error_register: 0 to 255. node: of a device in role
  // device, 0 = the only one.
  Call send_emcy(unsigned code, unsigned error_register,
                 const std::array<std::byte, 5>& manufacturer = {}, unsigned node = 0,
                 const CallOptions& options = {}) const;

  // COMMAND_CAN_SEND: a frame that no service of the line uses. identifier: 0 to 7FFh; extended: to
  // 1FFFFFFFh. data: up to 8 bytes; fd: also 12, 16, 20, 24, 32, 48 or 64.
  Call send_frame(std::uint32_t identifier, const Bytes& data, bool extended = false,
                  bool fd = false, bool bit_rate_switch = false,
                  const CallOptions& options = {}) const;
  // length: that is requested, 0 to 8.
  Call send_remote_frame(std::uint32_t identifier, unsigned length, bool extended = false,
                         const CallOptions& options = {}) const;
  // COMMAND_CAN_LISTEN: such frames as events for up to 1 h, 0 = no more. identifier, mask: 0 to
  // 1FFFFFFFh. mask: the bits of the
  // identifier that are compared. extended: only frames with 29-bit, or 11-bit, identifiers.
  Call listen(std::chrono::seconds seconds, std::uint32_t identifier = 0, std::uint32_t mask = 0,
              std::optional<bool> extended = {}, const CallOptions& options = {}) const;
  // COMMAND_ROUTING_TRACE: 1 s to 1 h.
  Call trace_routing(std::chrono::seconds seconds, const CallOptions& options = {}) const;

  // COMMAND_CONNECTION_OPEN, COMMAND_CONNECTION_CLOSE, COMMAND_CONNECTION_LIST: SDO connections
  // between two nodes.
  Answer<std::vector<SdoConnection>> open_connection(unsigned client, unsigned server,
                                                     const CallOptions& options = kLong) const;
  Call close_connection(std::uint32_t number, const CallOptions& options = kLong) const;
  Answer<std::vector<SdoConnection>> connections(const CallOptions& options = {}) const;

  // COMMAND_SLEEP, code 0 to 5. Result of the first two: the node-IDs of nodes that object.
  Answer<std::vector<std::uint8_t>> check_sleep(const CallOptions& options = {}) const;
  Answer<std::vector<std::uint8_t>> sleep(const CallOptions& options = {}) const;
  Call sleep_unchecked(const CallOptions& options = {}) const;
  Call wake_up(const CallOptions& options = {}) const;
  Call object_to_sleep(bool object, const CallOptions& options = {}) const;

  // Of the gateway: COMMAND_VERSIONS, COMMAND_BUS_RESTART, COMMAND_BUS_FAULT, COMMAND_JOURNAL_READ.
  Answer<std::string> versions(const CallOptions& options = {}) const;
  Call restart_bus(const CallOptions& options = {}) const;
  // Result: all faults; of a refusal, the error in words.
  Answer<std::string> set_bus_faults(std::string_view faults,
                                     const CallOptions& options = {}) const;
  Answer<JournalPage> read_journal(const JournalQuery& query,
                                   const CallOptions& options = {}) const;

 private:
  Error find_output(std::string_view name, const image::Entry*& entry, std::uint32_t& number,
                    std::uint64_t& layout_id) const;
  // Sends the request, or refuses the call with that text.
  Call start(std::string why, Request request, const CallOptions& options) const;

  Line line_;
};

}  // namespace linegate::client
