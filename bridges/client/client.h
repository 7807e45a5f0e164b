// SPDX-License-Identifier: Apache-2.0
// The client library: values of CAN lines by name, outputs, commands and events, from gateways in a
// DDS domain. This header needs the standard library alone.
//
// A Client runs in the thread of its caller: samples are received, call-backs are called and held
// outputs are written within poll(), Call::wait() and Line::wait(). It has no thread of its own on
// purpose: the watchdog of a group of outputs then watches the application, and not a thread that
// outlives its main loop. Use a client and its handles in one thread at a time; wake() is for any
// thread. Handles (Line, Group, Call, Subscription) remain valid after the client ended.
//
// No function throws. Times are UTC in nanoseconds since 1970-01-01, 0 = never, by the clock of the
// gateway.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <variant>
#include <vector>

namespace linegate::client {

using Duration = std::chrono::nanoseconds;

struct Core;
struct GroupData;
struct CallData;
struct SubscriptionData;

// --- values --------------------------------------------------------------------------------------

// How far a value can be relied on. The numbers are those of linegate.h; append only.
enum class Quality : std::uint8_t {
  good,            // inputs: received from a node that is present; outputs: sent to the node
  no_line,         // the line was not received yet
  no_data,         // its layout or its image was not received yet
  no_name,         // the layout has no such name
  not_received,    // inputs: no value was received from the node
  node_missing,    // inputs: the node does not answer, or its heartbeat was lost
  not_sent,        // outputs: the newest value was not sent yet, see Group::waiting()
  gateway_silent,  // the gateway published nothing for 3 s; the value is the last one
  gateway_lost,    // the gateway ended or is unreachable, or the line was removed; likewise
  ambiguous,  // several gateways have a line of that name: use "GATEWAY/LINE"; or its gateway has a
              // namesake
};
std::string_view describe(Quality quality);

// By type of the object: BOOLEAN: bool. INTEGERn: int64. UNSIGNEDn: uint64. REALn: double.
// VISIBLE_STRING (octets above 7Fh as in Latin-1) and UNICODE_STRING: string, in UTF-8, up to the
// first zero; both can be written as string. TIME_OF_DAY: int64, UTC in ns.
// TIME_DIFFERENCE: int64 in ns. Others: bytes.
using Data = std::variant<std::monostate, bool, std::int64_t, std::uint64_t, double, std::string,
                          std::vector<std::byte>>;

// A value with a scale or offset in plant.yaml or its device file is a double, in its unit.
struct Value {
  std::string name;
  Data data;         // the last one, whatever the quality; monostate: there is none
  Data raw;          // the one in the PDO, not scaled; the same as data if there is no scaling
  std::string unit;  // of data: "bar"; empty: none or unknown
  Quality quality = Quality::no_line;
  bool known = false;     // outputs: it was written, or has a default
  std::int64_t time = 0;  // of the last PDO that carried it; 0: none since the client began

  bool good() const { return quality == Quality::good; }
  // The number; `otherwise` if the quality is not good, or the value is no number in the range of
  // T.
  template <class T>
  T as(T otherwise = T{}) const;
  // As text, whatever the quality: "12", "true", "0A FF" (bytes), empty without data.
  std::string text() const;
};

// Values of one image: those of a direction are of one moment.
struct Snapshot {
  std::vector<Value> values;   // as requested
  std::int64_t time = 0;       // of the newest image used
  std::uint64_t sequence = 0;  // of that image
  std::uint64_t lost = 0;      // call-backs: images that this client did not receive since the last

  bool good() const;  // all of them are
  const Value& operator[](std::size_t i) const { return values[i]; }
};

// --- results -------------------------------------------------------------------------------------

// Of functions that change something. The numbers are those of linegate.h; append only.
enum class Error : std::uint8_t {
  none,
  bad_argument,
  not_ready,     // the line or its layout was not received, or its gateway is lost
  ambiguous,     // several gateways have a line of that name, or its gateway has a namesake
  no_name,       // no such output
  wrong_type,    // not convertible to the type of the output
  out_of_range,  // does not fit the type of the output, or is beyond its limits
  too_long,      // more than 4096 outputs
  closed,        // the client has ended, or could not connect
};
std::string_view describe(Error error);

enum class LineStatus : std::uint8_t {
  waiting,    // not, or not completely, received
  ready,      // values, outputs and commands are possible
  silent,     // its gateway published nothing for 3 s
  lost,       // its gateway ended or is unreachable, or removed the line
  ambiguous,  // several gateways have a line of that name, or its gateway has a namesake
};
std::string_view describe(LineStatus status);

// A change of a line.
struct Change {
  std::string gateway;
  std::string line;
  LineStatus status = LineStatus::waiting;
  bool restarted = false;       // by another start of the gateway
  bool layout_changed = false;  // names and places of the values are others
};

struct Event {
  std::string gateway;
  std::string line;  // empty: of the gateway itself
  std::uint64_t number = 0;
  std::uint64_t stream = 0;  // of the number
  std::int64_t time = 0;
  std::uint8_t kind = 0;      // EventKind of linegate.idl
  std::uint8_t severity = 0;  // 0 information, 1 warning, 2 error
  std::uint8_t node = 0;      // 1..127, 0 = the line itself
  std::uint32_t code = 0;     // by kind
  std::uint32_t value = 0;
  std::vector<std::byte> data{};
  std::string name{};  // of the kind: "heartbeat-lost"; empty: unknown to this version
  std::string text{};  // in words
  // Of follow_events(): numbers of the line directly before this one without an event, at most so
  // many are lost: a gateway that was killed leaves numbers out. And whether its journal was lost,
  // or the gateway has none and was started again.
  std::uint64_t missed = 0;
  bool journal_lost = false;
};

// Ends the call-backs when the last copy is destroyed.
class Subscription {
 public:
  Subscription() = default;

 private:
  friend struct Core;
  std::shared_ptr<SubscriptionData> data_;
};

// The same, of events in their order.
class EventReader {
 public:
  EventReader() = default;

  // Whether it follows events.
  explicit operator bool() const { return data_ != nullptr; }
  // Where the application is, the event of a call-back that runs included: a text to be stored, of
  // some 40 bytes for each line. With it follow_events() goes on with the next event, whatever
  // became of the application and the gateways meanwhile.
  std::string position() const;

 private:
  friend struct Core;
  std::shared_ptr<SubscriptionData> data_;
};

// --- commands ------------------------------------------------------------------------------------

enum class Outcome : std::uint8_t {
  pending,
  done,
  sdo_abort,  // code: SDO abort code of CiA 301
  interface,  // code: errno of the gateway's host
  refused,    // code: Refusal of linegate.idl; 10 timed out, 13 cancelled
};

struct CallOptions {
  Duration timeout = std::chrono::seconds(10);  // until the answer, waiting for the line included
  // How often it is tried: again after REFUSAL_BUSY; a command that only reads (SDO, other
  // networks, own dictionary, scan) also after the SDO abort 0504 0000h. After that abort a write
  // may have been carried out, so it is not repeated.
  unsigned attempts = 1;
};

// The members of a CommandRequest: linegate.idl, COMMANDS.md.
struct Request {
  std::uint8_t kind = 0;  // CommandKind
  std::uint8_t node = 0;
  std::uint16_t index = 0;
  std::uint8_t sub = 0;
  std::uint8_t nmt = 0;
  std::uint16_t code = 0;
  std::uint8_t error_register = 0;
  std::uint32_t entry = 0;
  std::uint64_t layout_id = 0;
  std::vector<std::byte> data{};
};

// A command under way, or its result. An unanswered request is repeated, and the gateway carries it
// out once; after a restart of the gateway it is refused (REFUSAL_WRONG_INCARNATION). A call goes
// on without its handle.
class Call {
 public:
  Call() = default;  // refused

  Outcome outcome() const;
  bool done() const { return outcome() != Outcome::pending; }
  bool ok() const { return outcome() == Outcome::done; }
  std::uint32_t code() const;
  std::string text() const;  // the error in words; empty if done
  // The data of the reply; of some commands also if it is refused.
  std::vector<std::byte> bytes() const;
  // They as a little-endian unsigned number of up to 8 bytes, else 0.
  std::uint64_t number() const;
  // Amount done and total of a long command, by its last report; 0 = unknown. A report names node
  // and kind of a command alone, so it may be of another client's.
  std::pair<std::uint32_t, std::uint32_t> progress() const;
  // Polls until it is done, at most until its time-out. Returns ok().
  bool wait();
  // Stops waiting: refused, with code 13. The gateway may carry it out nevertheless.
  void cancel();
  // Called once within poll(), also without a handle; the next time if it is done already. Empty:
  // no call-back any more.
  void on_done(std::function<void(const Call&)> call_back);

 private:
  friend struct Core;
  friend class Line;
  std::shared_ptr<Core> core_;
  std::shared_ptr<CallData> data_;
};

// --- outputs -------------------------------------------------------------------------------------

enum class GroupState : std::uint8_t {
  idle,     // nothing is written: not armed yet, or released
  taking,   // is written; the gateway did not report that it applies the values
  held,     // the gateway applies the values
  refused,  // the gateway refused them: reason(); nothing is written
  lost,     // reason(); nothing is written
};
std::string_view describe(GroupState state);

enum class LossReason : std::uint8_t {
  none,
  other_owner,  // a client of higher strength writes the group: owner()
  // The application did not poll in time, or the network was interrupted; or another flying master
  // was active. The next arm() has another arming number.
  watchdog,
  restarted,       // the gateway was started anew
  layout_changed,  // the values have other places, or the group has another number or name
  gateway_silent,  // published nothing for 3 s
  gateway_lost,
  ambiguous,  // several gateways have a line of that name, or its gateway has a namesake
  no_group,   // the line has no group of that name or number, or no longer
};
std::string_view describe(LossReason reason);

struct Setting {
  std::string name;
  Data value;
  bool raw = false;  // as Group::set_raw()
};

struct GroupOptions {
  // Time without a sample after which the gateway reacts; 0 = never. A sample is written every
  // quarter of it, at least every 200 ms.
  Duration watchdog = std::chrono::seconds(1);
  std::uint8_t reactions = 1;  // WATCHDOG_ bits of linegate.idl; 1: the outputs become 0
};

// A group of outputs as plant.yaml configures it. Nothing is written before arm(), and nothing
// after a loss until the next arm(): this is a decision of the application. A loss discards all
// values of the group, so an old set-point never returns; values that are set afterwards are
// written by the next arm(). When the last copy of the handle is destroyed, the group is released.
class Group {
 public:
  Group() = default;  // does nothing

  // The value of an output from now on, in its unit if it is scaled: it is rounded to the nearest
  // value that the PDO can carry. Values that are set between two poll() are sent together. Needs
  // a line that is ready.
  Error set(std::string_view name, const Data& value);
  template <class T>
  requires std::is_arithmetic_v<T> Error set(std::string_view name, T value);
  // The value in the PDO: without scaling, and beyond the limits.
  Error set_raw(std::string_view name, const Data& value);
  template <class T>
  requires std::is_arithmetic_v<T> Error set_raw(std::string_view name, T value);
  // All of these values, or none of them. failed: where to store the place of the first that is not
  // possible; may be nullptr.
  Error set(std::span<const Setting> settings, std::size_t* failed = nullptr);
  // Begins to write, with another arming number than before. Outputs that it was not given a value
  // for keep theirs: if another client held the group within the time of its watchdog, those of
  // that client. not_ready: the line is not ready, or the names of its groups were not received
  // yet; try again after the next poll.
  Error arm();
  // Stops writing: after its time the watchdog reacts.
  void release();
  GroupState state() const;
  bool held() const { return state() == GroupState::held; }
  bool lost() const;  // lost or refused: arm() is wanted
  LossReason reason() const;
  std::string text() const;   // the state in words, with its reason
  std::string owner() const;  // the client whose values the gateway applied last; empty: none
  // Outputs of the group that were not sent to their nodes, with the reason.
  std::vector<std::pair<std::string, std::string>> waiting() const;
  // Called within poll() when the state changes.
  Subscription on_state(std::function<void(const Group&)> call_back);

 private:
  friend struct Core;
  friend class Line;
  std::shared_ptr<Core> core_;
  std::shared_ptr<GroupData> data_;
};

// --- lines and gateways --------------------------------------------------------------------------

// A line by name: "LINE", or "GATEWAY/LINE". It need not exist yet. "LINE" is resolved when all
// discovered gateways were received, and is ambiguous while several gateways have it.
class Line {
 public:
  Line() = default;  // lost for ever

  std::string name() const;
  LineStatus status() const;
  bool ready() const { return status() == LineStatus::ready; }
  // Polls until it is ready. Returns whether it is.
  bool wait(Duration timeout) const;
  // Names are those of `linegate image`: "ram.Statusword", of inputs, else of outputs;
  // "outputs:ram.Controlword", "inputs:..." name the direction.
  Value read(const std::string& name) const;
  Snapshot read(const std::vector<std::string>& names) const;
  // The names of the layout; empty if it was not received.
  std::vector<std::string> inputs() const;
  std::vector<std::string> outputs() const;
  // Called within poll() at the beginning, and when data or quality of one of them changes.
  Subscription on_change(std::vector<std::string> names,
                         std::function<void(const Snapshot&)> call_back) const;
  // By name or number; empty: 0, of a line without groups.
  Group group(std::string_view name, const GroupOptions& options = {}) const;

  // COMMAND_SDO_READ, COMMAND_SDO_WRITE: of a device. A number out of its range refuses the call at
  // once, with REFUSAL_BAD_REQUEST: node 1..127, index 0..FFFFh, sub 0..255.
  Call sdo_read(unsigned node, unsigned index, unsigned sub, const CallOptions& options = {}) const;
  Call sdo_write(unsigned node, unsigned index, unsigned sub, std::vector<std::byte> value,
                 const CallOptions& options = {}) const;
  // The value has as many bytes as T.
  template <class T>
  requires std::is_arithmetic_v<T> Call sdo_write(unsigned node, unsigned index, unsigned sub,
                                                  T value, const CallOptions& options = {})
  const;
  // COMMAND_NMT. node: 0 = all. command: NMT_ of linegate.idl (1 start, 2 stop, 128
  // pre-operational, ...).
  Call nmt(unsigned node, unsigned command, const CallOptions& options = {}) const;
  // Any command; commands.h has each with typed parameters and results.
  Call request(Request request, const CallOptions& options = {}) const;

 private:
  friend class Client;
  friend class Commands;
  friend struct Core;
  Call refused(std::string why) const;  // a call that ends at once

  std::shared_ptr<Core> core_;
  std::string gateway_;
  std::string line_;
};

struct Options {
  std::uint32_t domain = 0;  // 0..232
  std::string profile{};     // file of QoS profiles; empty: the installed one, else a built-in one
  std::string identity{};    // folder of an identity for DDS-Security; empty: the environment
                             // variable LINEGATE_SECURITY, or without
  std::string name{};        // unique in the domain; empty: host, process ID and a number
  std::uint32_t strength = 0;  // ownership strength of outputs: the strongest client wins
  // With an identity of role viewer, which sends no requests.
  bool read_only = false;
  // Interfaces of this host for DDS, by name or IPv4 address; none: those of the profile.
  std::vector<std::string> interfaces{};
  // Hosts of gateways that multicast does not reach, by name or IPv4 address.
  std::vector<std::string> peers{};
  // Discovery servers of Fast DDS instead of multicast and peers: [ID@]HOST[:PORT], with the
  // position in this list as ID and 11811 as port if they are not given.
  std::vector<std::string> discovery_servers{};
  // Receive process images by multicast from gateways with `dds: {fan_out: multicast}`; from others
  // by unicast. Only without an identity.
  bool multicast = false;
  // Receive these lines alone, each "GATEWAY/LINE", of gateways with `dds: {partitions: true}`;
  // nothing is received of other gateways. None: all lines. Only without an identity.
  std::vector<std::string> lines{};
};

class Client {
 public:
  explicit Client(const Options& options);
  ~Client();
  Client(Client&&) noexcept;
  Client& operator=(Client&&) noexcept;

  bool ok() const;
  explicit operator bool() const { return ok(); }
  std::string error() const;  // why it could not connect
  std::string name() const;

  // Receives samples, calls call-backs, and writes held outputs. Waits until something was received
  // or the time has passed; may return early. Call it at least every 100 ms while outputs are held.
  // Returns ok().
  bool poll(Duration timeout);
  // Ends the present poll(), or the next one. From any thread.
  void wake();

  Line line(std::string_view name) const;
  // "GATEWAY/LINE" of all lines that were received and are not lost.
  std::vector<std::string> lines() const;
  // Of all lines. Each line that was received is reported at the beginning.
  Subscription on_line(std::function<void(const Change&)> call_back);
  // Events of all lines and gateways from now on, as they are received.
  Subscription on_event(std::function<void(const Event&)> call_back);
  // Events of all lines and gateways, those of a line in their order and each once; what this
  // client did not receive is read from the journals of the gateways. after:
  // EventReader::position() of this or an earlier run, or "" for the oldest events that the
  // journals have, as for a line that the position does not name; nothing: from now on, and of a
  // line that appears later, once its state was received. Returns an empty reader if `after` is no
  // position. With an identity of role viewer, and of gateways without a journal, events that were
  // not received are reported as missed.
  EventReader follow_events(const std::optional<std::string>& after,
                            std::function<void(const Event&)> call_back);

 private:
  friend struct Core;
  explicit Client(std::shared_ptr<Core> core);
  std::shared_ptr<Core> core_;
};

// --- templates -----------------------------------------------------------------------------------

template <class T>
T Value::as(T otherwise) const {
  static_assert(std::is_arithmetic_v<T>, "text() is the value as text");
  if (!good())
    return otherwise;
  return std::visit(
      [&](const auto& value) -> T {
        using Held = std::remove_cvref_t<decltype(value)>;
        if constexpr (!std::is_arithmetic_v<Held>) {
          return otherwise;
        } else if constexpr (std::is_same_v<T, bool>) {
          return value != Held{};
        } else if constexpr (std::is_integral_v<T> && std::is_floating_point_v<Held>) {
          // The limits are powers of two, so they are exact; no number compares as false.
          constexpr int bits = static_cast<int>(8 * sizeof(T)) - (std::is_signed_v<T> ? 1 : 0);
          const Held end = static_cast<Held>(std::uint64_t{1} << (bits - 1)) * 2;
          const Held begin = std::is_signed_v<T> ? -end : Held{0};
          return value >= begin && value < end ? static_cast<T>(value) : otherwise;
        } else if constexpr (std::is_integral_v<T> && !std::is_same_v<Held, bool>) {
          return std::in_range<T>(value) ? static_cast<T>(value) : otherwise;
        } else {
          return static_cast<T>(value);
        }
      },
      data);
}

namespace detail {

template <class T>
Data data_of(T value) {
  if constexpr (std::is_same_v<T, bool>)
    return value;
  else if constexpr (std::is_floating_point_v<T>)
    return static_cast<double>(value);
  else if constexpr (std::is_signed_v<T>)
    return static_cast<std::int64_t>(value);
  else
    return static_cast<std::uint64_t>(value);
}

}  // namespace detail

template <class T>
requires std::is_arithmetic_v<T> Error Group::set(std::string_view name, T value) {
  return set(name, detail::data_of(value));
}

template <class T>
requires std::is_arithmetic_v<T> Error Group::set_raw(std::string_view name, T value) {
  return set_raw(name, detail::data_of(value));
}

template <class T>
requires std::is_arithmetic_v<T> Call Line::sdo_write(unsigned node, unsigned index, unsigned sub,
                                                      T value, const CallOptions& options)
const {
  static_assert(sizeof(T) <= 8);
  std::vector<std::byte> bytes(sizeof(T));
  const auto* const from = reinterpret_cast<const std::byte*>(&value);
  for (std::size_t i = 0; i < sizeof(T); ++i) {
#if defined(__BYTE_ORDER__) && __BYTE_ORDER__ == __ORDER_BIG_ENDIAN__
    bytes[i] = from[sizeof(T) - 1 - i];
#else
    bytes[i] = from[i];
#endif
  }
  return sdo_write(node, index, sub, std::move(bytes), options);
}

}  // namespace linegate::client
