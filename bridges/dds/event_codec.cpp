// SPDX-License-Identifier: Apache-2.0
#include "bridges/dds/event_codec.h"

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <span>
#include <type_traits>
#include <variant>

#include <linegate.h>

#include "bridges/request/field_bytes.h"
#include "stack/base/assert.h"
#include "stack/base/byte_order.h"
#include "stack/pdo/parameters.h"

namespace linegate::dds {
namespace {

using request::FieldReader;

// --- numbers and data ----------------------------------------------------------------------------

template <class Number>
constexpr std::uint32_t pack_number(Number number) {
  return static_cast<std::uint32_t>(number);
}
template <class Rep, class Period>
constexpr std::uint32_t pack_number(std::chrono::duration<Rep, Period> time) {
  return static_cast<std::uint32_t>(time.count());
}

template <class Number>
constexpr void unpack_number(std::uint32_t from, Number& to) {
  to = static_cast<Number>(from);
}
template <class Rep, class Period>
constexpr void unpack_number(std::uint32_t from, std::chrono::duration<Rep, Period>& to) {
  to = std::chrono::duration<Rep, Period>(from);
}

// Appends to the data, little-endian.
void append(EventFields& to, std::uint64_t number, std::size_t size) {
  LINEGATE_ASSERT(to.length + size <= to.data.size(), "the data have room");
  store_le(std::span(to.data).subspan(to.length, size), number);
  to.length = static_cast<std::uint8_t>(to.length + size);
}
void append(EventFields& to, std::span<const std::byte> bytes) {
  LINEGATE_ASSERT(to.length + bytes.size() <= to.data.size(), "the data have room");
  std::ranges::copy(bytes, to.data.begin() + to.length);
  to.length = static_cast<std::uint8_t>(to.length + bytes.size());
}

template <std::size_t Size>
std::span<const std::byte> first_bytes(const std::array<std::byte, Size>& bytes, std::size_t used) {
  return std::span(bytes).first(std::min(used, Size));
}
template <std::size_t Size>
void copy_rest(FieldReader& from, std::array<std::byte, Size>& to) {
  std::ranges::copy(from.raw(std::min(from.left(), Size)), to.begin());
}

// Index (2), sub-index (1).
template <class Data>
void append_object(EventFields& to, const Data& from) {
  append(to, from.index, 2);
  append(to, from.sub, 1);
}
template <class Data>
void read_object(FieldReader& from, Data& to) {
  to.index = from.number<std::uint16_t>();
  to.sub = from.number<std::uint8_t>();
}

// The number of suppressed events, if any: 4 bytes from byte 8 on.
constexpr std::uint8_t kSuppressedAt = 8;
void append_suppressed(EventFields& to, std::uint32_t count) {
  LINEGATE_ASSERT(to.length <= kSuppressedAt, "the data leave room for the number");
  if (count != 0) {
    to.length = kSuppressedAt;
    append(to, count, sizeof count);
  }
}
std::uint32_t suppressed(const EventFields& from) {
  constexpr std::size_t kSize = sizeof(std::uint32_t);
  return from.length < kSuppressedAt + kSize
             ? 0
             : static_cast<std::uint32_t>(
                   load_le(std::span(from.data).subspan(kSuppressedAt, kSize)));
}

// The client that caused the event, if any: 4 bytes.
void append_client(EventFields& to, std::uint32_t number) {
  if (number != 0) {
    append(to, number, sizeof number);
  }
}
std::uint32_t client(const EventFields& from) {
  return from.length < sizeof(std::uint32_t)
             ? 0
             : static_cast<std::uint32_t>(load_le(std::span(from.data).first(4)));
}

// --- codecs --------------------------------------------------------------------------------------

// A codec has the kind of the contract, pack() and unpack(). Its comment is the layout: numbers in
// data are little-endian, with their size in bytes.
template <class Data>
struct EventCodec;

struct WithoutFields {
  template <class Data>
  static void pack(const Data& /*from*/, EventFields& /*to*/) {}
  template <class Data>
  static void unpack(const EventFields& /*from*/, Data& /*to*/) {}
};

// code: new state; value: the state before.
struct WithStates {
  template <class Data>
  static void pack(const Data& from, EventFields& to) {
    to.code = pack_number(from.state);
    to.value = pack_number(from.before);
  }
  template <class Data>
  static void unpack(const EventFields& from, Data& to) {
    unpack_number(from.code, to.state);
    unpack_number(from.value, to.before);
  }
};

// code: NMT state.
struct WithState {
  template <class Data>
  static void pack(const Data& from, EventFields& to) {
    to.code = pack_number(from.state);
  }
  template <class Data>
  static void unpack(const EventFields& from, Data& to) {
    unpack_number(from.code, to.state);
  }
};

// code: NMT command specifier.
struct WithCommand {
  template <class Data>
  static void pack(const Data& from, EventFields& to) {
    to.code = pack_number(from.command);
  }
  template <class Data>
  static void unpack(const EventFields& from, Data& to) {
    unpack_number(from.code, to.command);
  }
};

// code: emergency error code; value: error register; data: manufacturer bytes (5); of CANopen FD
// also logical device, profile (2), status, TIME_OF_DAY (6).
struct WithEmcy {
  template <class Data>
  static void pack(const Data& from, EventFields& to) {
    to.code = from.code;
    to.value = from.error_register;
    append(to, from.manufacturer);
    if (from.fd.any) {
      append(to, from.fd.logical_device, 1);
      append(to, from.fd.profile, 2);
      append(to, from.fd.status, 1);
      append(to, from.fd.time_of_day);
    }
  }
  template <class Data>
  static void unpack(const EventFields& from, Data& to) {
    FieldReader data(from.bytes());
    unpack_number(from.code, to.code);
    unpack_number(from.value, to.error_register);
    copy_rest(data, to.manufacturer);
    if (data.left() > 0) {
      to.fd.any = true;
      to.fd.logical_device = data.number<std::uint8_t>();
      to.fd.profile = data.number<std::uint16_t>();
      to.fd.status = data.number<std::uint8_t>();
      copy_rest(data, to.fd.time_of_day);
    }
  }
};

// --- the line and its bus ------------------------------------------------------------------------

// code: Role.
template <>
struct EventCodec<event::LineStarted> {
  static constexpr v1::EventKind kKind = v1::EVENT_LINE_STARTED;
  static void pack(const event::LineStarted& from, EventFields& to) {
    to.code = pack_number(from.role);
  }
  static void unpack(const EventFields& from, event::LineStarted& to) {
    unpack_number(from.code, to.role);
  }
};

template <>
struct EventCodec<event::LineStopped> : WithoutFields {
  static constexpr v1::EventKind kKind = v1::EVENT_LINE_STOPPED;
};

// code: new BusState; value: the one before; data: TEC (1), REC (1).
template <>
struct EventCodec<event::BusState> {
  static constexpr v1::EventKind kKind = v1::EVENT_BUS_STATE;
  static void pack(const event::BusState& from, EventFields& to) {
    WithStates::pack(from, to);
    append(to, from.transmit_errors, 1);
    append(to, from.receive_errors, 1);
  }
  static void unpack(const EventFields& from, event::BusState& to) {
    FieldReader data(from.bytes());
    WithStates::unpack(from, to);
    to.transmit_errors = data.number<std::uint8_t>();
    to.receive_errors = data.number<std::uint8_t>();
  }
};

// code: bits of the error frame; data: from byte 8, if any, number of suppressed events (4).
template <>
struct EventCodec<event::BusError> {
  static constexpr v1::EventKind kKind = v1::EVENT_BUS_ERROR;
  static void pack(const event::BusError& from, EventFields& to) {
    to.code = from.errors;
    append_suppressed(to, from.suppressed);
  }
  static void unpack(const EventFields& from, event::BusError& to) {
    to.errors = from.code;
    to.suppressed = suppressed(from);
  }
};

// value: number of frames.
template <>
struct EventCodec<event::FramesLost> {
  static constexpr v1::EventKind kKind = v1::EVENT_FRAMES_LOST;
  static void pack(const event::FramesLost& from, EventFields& to) { to.value = from.frames; }
  static void unpack(const EventFields& from, event::FramesLost& to) { to.frames = from.value; }
};

// code: errno.
template <>
struct EventCodec<event::InterfaceFailed> {
  static constexpr v1::EventKind kKind = v1::EVENT_INTERFACE_FAILED;
  static void pack(const event::InterfaceFailed& from, EventFields& to) { to.code = from.error; }
  static void unpack(const EventFields& from, event::InterfaceFailed& to) { to.error = from.code; }
};

template <>
struct EventCodec<event::InterfaceReady> : WithoutFields {
  static constexpr v1::EventKind kKind = v1::EVENT_INTERFACE_READY;
};

// data: number of the first (8) and of the last lost event (8).
template <>
struct EventCodec<event::EventsLost> {
  static constexpr v1::EventKind kKind = v1::EVENT_EVENTS_LOST;
  static void pack(const event::EventsLost& from, EventFields& to) {
    append(to, from.first, 8);
    append(to, from.last, 8);
  }
  static void unpack(const EventFields& from, event::EventsLost& to) {
    FieldReader data(from.bytes());
    to.first = data.number<std::uint64_t>();
    to.last = data.number<std::uint64_t>();
  }
};

// value: ms.
template <>
struct EventCodec<event::ClockStep> {
  static constexpr v1::EventKind kKind = v1::EVENT_CLOCK_STEP;
  static void pack(const event::ClockStep& from, EventFields& to) {
    to.value = pack_number(from.step);
  }
  static void unpack(const EventFields& from, event::ClockStep& to) {
    unpack_number(from.value, to.step);
  }
};

// code: the queue; value: number of lost entries.
template <>
struct EventCodec<event::QueueFull> {
  static constexpr v1::EventKind kKind = v1::EVENT_QUEUE_FULL;
  static void pack(const event::QueueFull& from, EventFields& to) {
    to.code = pack_number(from.queue);
    to.value = from.lost;
  }
  static void unpack(const EventFields& from, event::QueueFull& to) {
    unpack_number(from.code, to.queue);
    to.lost = from.value;
  }
};

// data: layout_id of the inputs (8), of the outputs (8).
template <>
struct EventCodec<event::LayoutChanged> {
  static constexpr v1::EventKind kKind = v1::EVENT_LAYOUT_CHANGED;
  static void pack(const event::LayoutChanged& from, EventFields& to) {
    append(to, from.inputs, 8);
    append(to, from.outputs, 8);
  }
  static void unpack(const EventFields& from, event::LayoutChanged& to) {
    FieldReader data(from.bytes());
    to.inputs = data.number<std::uint64_t>();
    to.outputs = data.number<std::uint64_t>();
  }
};

// code: CAN identifier; value: length of the frame; data: its first bytes, up to 8; from byte 8, if
// any, number of suppressed events (4).
template <>
struct EventCodec<event::MalformedFrame> {
  static constexpr v1::EventKind kKind = v1::EVENT_MALFORMED_FRAME;
  static void pack(const event::MalformedFrame& from, EventFields& to) {
    to.code = from.identifier;
    to.value = from.length;
    append(to, first_bytes(from.data, from.length));
    append_suppressed(to, from.suppressed);
  }
  static void unpack(const EventFields& from, event::MalformedFrame& to) {
    FieldReader data(from.bytes());
    to.identifier = from.code;
    unpack_number(from.value, to.length);
    copy_rest(data, to.data);
    to.suppressed = suppressed(from);
  }
};

// code: CAN identifier, bit 31: 29-bit identifier; value: bits 0-7 length of the frame, 8 remote
// frame, 9 CAN FD, 10-11 piece, 16-31 number of suppressed events (65535: or more); data: bytes of
// the frame from byte 16 x piece on.
template <>
struct EventCodec<event::CanFrame> {
  static constexpr v1::EventKind kKind = v1::EVENT_CAN_FRAME;

  static constexpr std::uint32_t kExtended = 0x8000'0000;
  static constexpr std::uint32_t kRemote = 0x100;
  static constexpr std::uint32_t kFd = 0x200;
  static constexpr unsigned kPieceBit = 10;
  static constexpr std::uint32_t kPieces = 0b11;
  static constexpr unsigned kSuppressedBit = 16;

  static void pack(const event::CanFrame& from, EventFields& to) {
    to.code = from.identifier | (from.extended ? kExtended : 0U);
    to.value = from.length | (from.remote ? kRemote : 0U) | (from.fd ? kFd : 0U) |
               pack_number(from.piece) << kPieceBit |
               pack_number(from.suppressed) << kSuppressedBit;
    append(to, first_bytes(from.data, from.bytes()));
  }
  static void unpack(const EventFields& from, event::CanFrame& to) {
    FieldReader data(from.bytes());
    to.identifier = from.code & ~kExtended;
    to.extended = (from.code & kExtended) != 0;
    unpack_number(from.value, to.length);
    to.remote = (from.value & kRemote) != 0;
    to.fd = (from.value & kFd) != 0;
    to.piece = static_cast<std::uint8_t>(from.value >> kPieceBit & kPieces);
    unpack_number(from.value >> kSuppressedBit, to.suppressed);
    copy_rest(data, to.data);
  }
};

// --- the own node --------------------------------------------------------------------------------

template <>
struct EventCodec<event::ManagerState> : WithStates {
  static constexpr v1::EventKind kKind = v1::EVENT_MANAGER_STATE;
};

// code: new NMT state; value: the one before; data: node-ID on the bus (1).
template <>
struct EventCodec<event::OwnState> {
  static constexpr v1::EventKind kKind = v1::EVENT_OWN_STATE;
  static void pack(const event::OwnState& from, EventFields& to) {
    WithStates::pack(from, to);
    append(to, from.node_id, 1);
  }
  static void unpack(const EventFields& from, event::OwnState& to) {
    FieldReader data(from.bytes());
    WithStates::unpack(from, to);
    to.node_id = data.number<std::uint8_t>();
  }
};

template <>
struct EventCodec<event::EmcySent> : WithEmcy {
  static constexpr v1::EventKind kKind = v1::EVENT_EMCY_SENT;
};

// value: period in us.
template <>
struct EventCodec<event::SyncLost> {
  static constexpr v1::EventKind kKind = v1::EVENT_SYNC_LOST;
  static void pack(const event::SyncLost& from, EventFields& to) {
    to.value = pack_number(from.period);
  }
  static void unpack(const EventFields& from, event::SyncLost& to) {
    unpack_number(from.value, to.period);
  }
};

// code: NMT state in its heartbeat, 0 = boot-up message, 255 = EMCY.
template <>
struct EventCodec<event::DuplicateNodeId> : WithState {
  static constexpr v1::EventKind kKind = v1::EVENT_DUPLICATE_NODE_ID;
};

// code: number of suppressed events; value: bytes of the value; data: index (2), sub-index (1),
// first bytes of the value, up to 13.
template <>
struct EventCodec<event::ObjectWritten> {
  static constexpr v1::EventKind kKind = v1::EVENT_OBJECT_WRITTEN;
  static void pack(const event::ObjectWritten& from, EventFields& to) {
    to.code = from.suppressed;
    to.value = from.size;
    append_object(to, from);
    append(to, first_bytes(from.data, from.size));
  }
  static void unpack(const EventFields& from, event::ObjectWritten& to) {
    FieldReader data(from.bytes());
    to.suppressed = from.code;
    to.size = from.value;
    read_object(data, to);
    copy_rest(data, to.data);
  }
};

template <>
struct EventCodec<event::OwnReset> : WithCommand {
  static constexpr v1::EventKind kKind = v1::EVENT_OWN_RESET;
};

// data: UTC in ns since 1970-01-01 (8).
template <>
struct EventCodec<event::TimeReceived> {
  static constexpr v1::EventKind kKind = v1::EVENT_TIME_RECEIVED;
  static void pack(const event::TimeReceived& from, EventFields& to) {
    append(to, static_cast<std::uint64_t>(from.utc.count()), 8);
  }
  static void unpack(const EventFields& from, event::TimeReceived& to) {
    FieldReader data(from.bytes());
    to.utc = Duration(data.number<std::int64_t>());
  }
};

// --- nodes ---------------------------------------------------------------------------------------

template <>
struct EventCodec<event::BootUp> : WithoutFields {
  static constexpr v1::EventKind kKind = v1::EVENT_BOOT_UP;
};

template <>
struct EventCodec<event::NodeState> : WithStates {
  static constexpr v1::EventKind kKind = v1::EVENT_NODE_STATE;
};

// code: 0 heartbeat, 1 node guarding, 2 life guarding of the own node; value: consumer heartbeat
// time or life time in ms.
template <>
struct EventCodec<event::HeartbeatLost> {
  static constexpr v1::EventKind kKind = v1::EVENT_HEARTBEAT_LOST;
  static void pack(const event::HeartbeatLost& from, EventFields& to) {
    to.code = pack_number(from.by);
    to.value = pack_number(from.time);
  }
  static void unpack(const EventFields& from, event::HeartbeatLost& to) {
    unpack_number(from.code, to.by);
    unpack_number(from.value, to.time);
  }
};

template <>
struct EventCodec<event::HeartbeatRecovered> : WithState {
  static constexpr v1::EventKind kKind = v1::EVENT_HEARTBEAT_RECOVERED;
};

// code: letter, 0 = booted; value: SDO abort code, or the value found; data, if an object caused
// the result: index (2), sub-index (1), 1 = value is an abort code, 2 = value was read, 3 = the
// object was the last one written (1), expected value (4).
template <>
struct EventCodec<event::BootResult> {
  static constexpr v1::EventKind kKind = v1::EVENT_BOOT_RESULT;

  static void pack(const event::BootResult& from, EventFields& to) {
    to.code = static_cast<std::uint8_t>(from.letter);
    if (from.cause == event::BootCause::none)
      return;
    to.value = from.cause == event::BootCause::abort ? pack_number(from.abort) : from.found;
    append_object(to, from);
    append(to, pack_number(from.cause), 1);
    append(to, from.expected, 4);
  }
  static void unpack(const EventFields& from, event::BootResult& to) {
    FieldReader data(from.bytes());
    unpack_number(from.code, to.letter);
    read_object(data, to);
    to.cause = data.number<event::BootCause>(1);
    to.expected = data.number<std::uint32_t>();
    if (!data.good() || to.cause == event::BootCause::none ||
        to.cause > event::BootCause::written) {
      to = {.letter = to.letter};
    } else if (to.cause == event::BootCause::abort) {
      unpack_number(from.value, to.abort);
    } else {
      to.found = from.value;
    }
  }
};

template <>
struct EventCodec<event::Emcy> : WithEmcy {
  static constexpr v1::EventKind kKind = v1::EVENT_EMCY;
};

// code: SDO abort code; data: index (2), sub-index (1).
template <>
struct EventCodec<event::ConfigurationError> {
  static constexpr v1::EventKind kKind = v1::EVENT_CONFIGURATION_ERROR;
  static void pack(const event::ConfigurationError& from, EventFields& to) {
    to.code = pack_number(from.abort);
    append_object(to, from);
  }
  static void unpack(const EventFields& from, event::ConfigurationError& to) {
    FieldReader data(from.bytes());
    unpack_number(from.code, to.abort);
    read_object(data, to);
  }
};

// code: NMT state.
template <>
struct EventCodec<event::UnexpectedNode> : WithState {
  static constexpr v1::EventKind kKind = v1::EVENT_UNEXPECTED_NODE;
};

// code: NMT state now, 0 = boot-up message; value: the one before.
template <>
struct EventCodec<event::SpontaneousChange> : WithStates {
  static constexpr v1::EventKind kKind = v1::EVENT_SPONTANEOUS_CHANGE;
};

// code: the evidence; data, if it is 1 (two responses to one SDO request): index (2), sub-index
// (1).
template <>
struct EventCodec<event::SharedNodeId> {
  static constexpr v1::EventKind kKind = v1::EVENT_SHARED_NODE_ID;
  static void pack(const event::SharedNodeId& from, EventFields& to) {
    to.code = pack_number(from.evidence);
    if (from.evidence == event::SharedIdEvidence::two_responses)
      append_object(to, from);
  }
  static void unpack(const EventFields& from, event::SharedNodeId& to) {
    FieldReader data(from.bytes());
    unpack_number(from.code, to.evidence);
    read_object(data, to);
  }
};

// code: SDO abort code that ended the scan early, or 0; value: number of objects read.
template <>
struct EventCodec<event::NodeScanned> {
  static constexpr v1::EventKind kKind = v1::EVENT_NODE_SCANNED;
  static void pack(const event::NodeScanned& from, EventFields& to) {
    to.code = pack_number(from.abort);
    to.value = from.objects;
  }
  static void unpack(const EventFields& from, event::NodeScanned& to) {
    unpack_number(from.code, to.abort);
    to.objects = from.value;
  }
};

// code: lss::Verdict; value: bits 0-7 error, 8-15 specific error; data, if known: LSS address,
// vendor-ID, product code, revision and serial number (4 each).
template <>
struct EventCodec<event::LssResult> {
  static constexpr v1::EventKind kKind = v1::EVENT_LSS_RESULT;
  static void pack(const event::LssResult& from, EventFields& to) {
    to.code = pack_number(from.verdict);
    to.value = from.error | pack_number(from.specific) << 8U;
    if (from.address) {
      for (const std::uint32_t part : *from.address)
        append(to, part, sizeof part);
    }
  }
  static void unpack(const EventFields& from, event::LssResult& to) {
    FieldReader data(from.bytes());
    unpack_number(from.code, to.verdict);
    unpack_number(from.value, to.error);
    unpack_number(from.value >> 8U, to.specific);
    std::array<std::uint32_t, 4> address{};
    for (std::uint32_t& part : address)
      part = data.number<std::uint32_t>();
    if (data.good())
      to.address = address;
  }
};

// --- PDO and SDO ---------------------------------------------------------------------------------

// code: PDO number; value: bytes mapped; data: bytes received (1).
template <>
struct EventCodec<event::PdoLength> {
  static constexpr v1::EventKind kKind = v1::EVENT_PDO_LENGTH;
  static void pack(const event::PdoLength& from, EventFields& to) {
    to.code = from.number;
    to.value = from.mapped;
    append(to, from.received, 1);
  }
  static void unpack(const EventFields& from, event::PdoLength& to) {
    FieldReader data(from.bytes());
    unpack_number(from.code, to.number);
    unpack_number(from.value, to.mapped);
    to.received = data.number<std::uint8_t>();
  }
};

// code: PDO number; value: deadline in ms.
template <>
struct EventCodec<event::PdoTimeout> {
  static constexpr v1::EventKind kKind = v1::EVENT_PDO_TIMEOUT;
  static void pack(const event::PdoTimeout& from, EventFields& to) {
    to.code = from.number;
    to.value = pack_number(from.deadline);
  }
  static void unpack(const EventFields& from, event::PdoTimeout& to) {
    unpack_number(from.code, to.number);
    unpack_number(from.value, to.deadline);
  }
};

// code: PDO number.
template <>
struct EventCodec<event::PdoRecovered> {
  static constexpr v1::EventKind kKind = v1::EVENT_PDO_RECOVERED;
  static void pack(const event::PdoRecovered& from, EventFields& to) { to.code = from.number; }
  static void unpack(const EventFields& from, event::PdoRecovered& to) {
    unpack_number(from.code, to.number);
  }
};

// code: CAN identifier.
template <>
struct EventCodec<event::ForeignSdo> {
  static constexpr v1::EventKind kKind = v1::EVENT_FOREIGN_SDO;
  static void pack(const event::ForeignSdo& from, EventFields& to) { to.code = from.identifier; }
  static void unpack(const EventFields& from, event::ForeignSdo& to) { to.identifier = from.code; }
};

// code: SDO abort code; data: index (2), sub-index (1); from byte 8, if any, number of suppressed
// events (4).
template <>
struct EventCodec<event::SdoAbort> {
  static constexpr v1::EventKind kKind = v1::EVENT_SDO_ABORT;
  static void pack(const event::SdoAbort& from, EventFields& to) {
    to.code = pack_number(from.abort);
    append_object(to, from);
    append_suppressed(to, from.suppressed);
  }
  static void unpack(const EventFields& from, event::SdoAbort& to) {
    FieldReader data(from.bytes());
    unpack_number(from.code, to.abort);
    read_object(data, to);
    to.suppressed = suppressed(from);
  }
};

// --- outputs and commands ------------------------------------------------------------------------

// code: OutputRefusal; value: group; data: client (4), if any; from byte 8, if any, number of
// suppressed events (4).
template <>
struct EventCodec<event::OutputRefused> {
  static constexpr v1::EventKind kKind = v1::EVENT_OUTPUT_REFUSED;
  static void pack(const event::OutputRefused& from, EventFields& to) {
    to.code = pack_number(from.refusal);
    to.value = from.group;
    append_client(to, from.client);
    append_suppressed(to, from.suppressed);
  }
  static void unpack(const EventFields& from, event::OutputRefused& to) {
    to.client = client(from);
    unpack_number(from.code, to.refusal);
    unpack_number(from.value, to.group);
    to.suppressed = suppressed(from);
  }
};

// code: watchdog in ms; value: group; data: client (4), if any.
template <>
struct EventCodec<event::OutputArmed> {
  static constexpr v1::EventKind kKind = v1::EVENT_OUTPUT_ARMED;
  static void pack(const event::OutputArmed& from, EventFields& to) {
    to.code = pack_number(from.watchdog);
    to.value = from.group;
    append_client(to, from.client);
  }
  static void unpack(const EventFields& from, event::OutputArmed& to) {
    to.client = client(from);
    unpack_number(from.code, to.watchdog);
    unpack_number(from.value, to.group);
  }
};

// code: WATCHDOG_ bits that were applied; value: group.
template <>
struct EventCodec<event::OutputWatchdog> {
  static constexpr v1::EventKind kKind = v1::EVENT_OUTPUT_WATCHDOG;
  static void pack(const event::OutputWatchdog& from, EventFields& to) {
    to.code = from.reactions;
    to.value = from.group;
  }
  static void unpack(const EventFields& from, event::OutputWatchdog& to) {
    unpack_number(from.code, to.reactions);
    unpack_number(from.value, to.group);
  }
};

// code: Refusal; value: CommandKind; data: client (4), if any; from byte 8, if any, number of
// suppressed events (4).
template <>
struct EventCodec<event::CommandRefused> {
  static constexpr v1::EventKind kKind = v1::EVENT_COMMAND_REFUSED;
  static void pack(const event::CommandRefused& from, EventFields& to) {
    to.code = pack_number(from.refusal);
    to.value = pack_number(from.command);
    append_client(to, from.client);
    append_suppressed(to, from.suppressed);
  }
  static void unpack(const EventFields& from, event::CommandRefused& to) {
    to.client = client(from);
    unpack_number(from.code, to.refusal);
    unpack_number(from.value, to.command);
    to.suppressed = suppressed(from);
  }
};

// code: CommandKind; value: client; data: index (2), sub-index (1) of the object, else 0; from byte
// 8, if any, number of suppressed events (4).
template <>
struct EventCodec<event::CommandAccepted> {
  static constexpr v1::EventKind kKind = v1::EVENT_COMMAND_ACCEPTED;
  static void pack(const event::CommandAccepted& from, EventFields& to) {
    to.code = pack_number(from.command);
    to.value = from.client;
    append_object(to, from);
    append_suppressed(to, from.suppressed);
  }
  static void unpack(const EventFields& from, event::CommandAccepted& to) {
    FieldReader data(from.bytes());
    unpack_number(from.code, to.command);
    to.client = from.value;
    read_object(data, to);
    to.suppressed = suppressed(from);
  }
};

// code: group; value: client; data: client before (4); from byte 8, if any, number of suppressed
// events (4).
template <>
struct EventCodec<event::OutputOwner> {
  static constexpr v1::EventKind kKind = v1::EVENT_OUTPUT_OWNER;
  static void pack(const event::OutputOwner& from, EventFields& to) {
    to.code = from.group;
    to.value = from.client;
    append(to, from.before, 4);
    append_suppressed(to, from.suppressed);
  }
  static void unpack(const EventFields& from, event::OutputOwner& to) {
    FieldReader data(from.bytes());
    unpack_number(from.code, to.group);
    to.client = from.value;
    to.before = data.number<std::uint32_t>();
    to.suppressed = suppressed(from);
  }
};

// code: client; value: delayed commands; data: refused commands (4), replaced outputs (4).
template <>
struct EventCodec<event::ClientLimited> {
  static constexpr v1::EventKind kKind = v1::EVENT_CLIENT_LIMITED;
  static void pack(const event::ClientLimited& from, EventFields& to) {
    to.code = from.client;
    to.value = from.delayed;
    append(to, from.refused, 4);
    append(to, from.replaced, 4);
  }
  static void unpack(const EventFields& from, event::ClientLimited& to) {
    FieldReader data(from.bytes());
    to.client = from.code;
    to.delayed = from.value;
    to.refused = data.number<std::uint32_t>();
    to.replaced = data.number<std::uint32_t>();
  }
};

// code: CommandKind; value: amount done; data: total amount (4), 0 = unknown.
template <>
struct EventCodec<event::CommandProgress> {
  static constexpr v1::EventKind kKind = v1::EVENT_COMMAND_PROGRESS;
  static void pack(const event::CommandProgress& from, EventFields& to) {
    to.code = pack_number(from.command);
    to.value = from.done;
    append(to, from.total, 4);
  }
  static void unpack(const EventFields& from, event::CommandProgress& to) {
    FieldReader data(from.bytes());
    unpack_number(from.code, to.command);
    to.done = from.value;
    to.total = data.number<std::uint32_t>();
  }
};

// --- traffic of other nodes ----------------------------------------------------------------------

template <>
struct EventCodec<event::NmtCommand> : WithCommand {
  static constexpr v1::EventKind kKind = v1::EVENT_NMT_COMMAND;
};

// code: bit 0: 0 upload (read), 1 download (written), bits 16-31 number of suppressed events
// (65535: or more); value: bytes of the value; data: index (2), sub-index (1), first bytes of the
// value, up to 13.
template <>
struct EventCodec<event::SdoTransfer> {
  static constexpr v1::EventKind kKind = v1::EVENT_SDO_TRANSFER;
  static constexpr unsigned kSuppressedBit = 16;

  static void pack(const event::SdoTransfer& from, EventFields& to) {
    to.code = (from.download ? 1U : 0U) | pack_number(from.suppressed) << kSuppressedBit;
    to.value = from.size;
    append_object(to, from);
    append(to, first_bytes(from.data, from.size));
  }
  static void unpack(const EventFields& from, event::SdoTransfer& to) {
    FieldReader data(from.bytes());
    to.download = (from.code & 1U) != 0;
    unpack_number(from.code >> kSuppressedBit, to.suppressed);
    to.size = from.value;
    read_object(data, to);
    copy_rest(data, to.data);
  }
};

// code: PDO number; value: 0 TPDO, 1 RPDO; data: 1 if its mapping is known completely (1).
template <>
struct EventCodec<event::PdoMapping> {
  static constexpr v1::EventKind kKind = v1::EVENT_PDO_MAPPING;
  static void pack(const event::PdoMapping& from, EventFields& to) {
    to.code = from.number;
    to.value = from.kind == pdo::PdoKind::tpdo ? 0 : 1;
    append(to, from.complete ? 1 : 0, 1);
  }
  static void unpack(const EventFields& from, event::PdoMapping& to) {
    FieldReader data(from.bytes());
    unpack_number(from.code, to.number);
    to.kind = from.value == 0 ? pdo::PdoKind::tpdo : pdo::PdoKind::rpdo;
    to.complete = data.number<std::uint8_t>() != 0;
  }
};

// code: 1 NMT command, 2 message of flying masters, 3 prepare message of sleep; value: command
// specifier, or its identifier; data: addressee of the command (1), 0 = all.
template <>
struct EventCodec<event::ForeignManager> {
  static constexpr v1::EventKind kKind = v1::EVENT_FOREIGN_MANAGER;
  static void pack(const event::ForeignManager& from, EventFields& to) {
    const bool is_command = from.evidence == event::ManagerEvidence::nmt_command;
    to.code = pack_number(from.evidence);
    to.value = is_command ? pack_number(from.command) : from.identifier;
    append(to, from.addressee, 1);
  }
  static void unpack(const EventFields& from, event::ForeignManager& to) {
    FieldReader data(from.bytes());
    unpack_number(from.code, to.evidence);
    if (to.evidence == event::ManagerEvidence::nmt_command)
      unpack_number(from.value, to.command);
    else
      to.identifier = from.value;
    to.addressee = data.number<std::uint8_t>();
  }
};

// code: state now; value: the one before; data: own priority (1).
template <>
struct EventCodec<event::FlyingMaster> {
  static constexpr v1::EventKind kKind = v1::EVENT_FLYING_MASTER;
  static void pack(const event::FlyingMaster& from, EventFields& to) {
    to.code = pack_number(from.state);
    to.value = pack_number(from.before);
    append(to, from.priority, 1);
  }
  static void unpack(const EventFields& from, event::FlyingMaster& to) {
    FieldReader data(from.bytes());
    unpack_number(from.code, to.state);
    unpack_number(from.value, to.before);
    to.priority = data.number<std::uint8_t>();
  }
};

// --- other networks ------------------------------------------------------------------------------

// code: SDO abort code; data: source network (2; 0 = the gateway itself), target network (2),
// target node (1), service (1; 0 SDO, 1 EMCY, 2 PDO).
template <>
struct EventCodec<event::RoutingRefused> {
  static constexpr v1::EventKind kKind = v1::EVENT_ROUTING_REFUSED;
  static void pack(const event::RoutingRefused& from, EventFields& to) {
    to.code = pack_number(from.abort);
    append(to, from.source, 2);
    append(to, from.target, 2);
    append(to, from.target_node, 1);
    append(to, pack_number(from.service), 1);
  }
  static void unpack(const EventFields& from, event::RoutingRefused& to) {
    FieldReader data(from.bytes());
    unpack_number(from.code, to.abort);
    to.source = data.number<std::uint16_t>();
    to.target = data.number<std::uint16_t>();
    to.target_node = data.number<std::uint8_t>();
    to.service = data.number<routing::RoutedService>();
  }
};

// code: emergency error code; data: error register (1), network (2) and node-ID (1) of its source,
// hops (1), number (1).
template <>
struct EventCodec<event::EmcyRouted> {
  static constexpr v1::EventKind kKind = v1::EVENT_EMCY_ROUTED;
  static void pack(const event::EmcyRouted& from, EventFields& to) {
    to.code = from.code;
    append(to, from.error_register, 1);
    append(to, from.source, 2);
    append(to, from.source_node, 1);
    append(to, from.hops, 1);
    append(to, from.number, 1);
  }
  static void unpack(const EventFields& from, event::EmcyRouted& to) {
    FieldReader data(from.bytes());
    unpack_number(from.code, to.code);
    to.error_register = data.number<std::uint8_t>();
    to.source = data.number<std::uint16_t>();
    to.source_node = data.number<std::uint8_t>();
    to.hops = data.number<std::uint8_t>();
    to.number = data.number<std::uint8_t>();
  }
};

// Source network (2; 0 = the gateway itself), target network (2), target node (1), outgoing
// interface (1), node-ID of the next gateway there or 0 (1).
template <class Data>
void append_way(EventFields& to, const Data& from) {
  append(to, from.source, 2);
  append(to, from.target, 2);
  append(to, from.target_node, 1);
  append(to, from.interface, 1);
  append(to, from.gateway, 1);
}
template <class Data>
void read_way(FieldReader& from, Data& to) {
  to.source = from.number<std::uint16_t>();
  to.target = from.number<std::uint16_t>();
  to.target_node = from.number<std::uint8_t>();
  to.interface = from.number<std::uint8_t>();
  to.gateway = from.number<std::uint8_t>();
}

// code: number of the connection; value: number of suppressed events; data: way (7), hops (1).
template <>
struct EventCodec<event::RoutingOpened> {
  static constexpr v1::EventKind kKind = v1::EVENT_ROUTING_OPENED;
  static void pack(const event::RoutingOpened& from, EventFields& to) {
    to.code = from.connection;
    to.value = from.suppressed;
    append_way(to, from);
    append(to, from.hops, 1);
  }
  static void unpack(const EventFields& from, event::RoutingOpened& to) {
    FieldReader data(from.bytes());
    to.connection = from.code;
    to.suppressed = from.value;
    read_way(data, to);
    to.hops = data.number<std::uint8_t>();
  }
};

// code: SDO abort code, 0 = completed; value: bytes transferred; data: way (7), service (1; 0 none,
// 1 upload, 2 download), index (2), sub-index (1), number of the connection (4).
template <>
struct EventCodec<event::RoutingEnded> {
  static constexpr v1::EventKind kKind = v1::EVENT_ROUTING_ENDED;
  static void pack(const event::RoutingEnded& from, EventFields& to) {
    to.code = pack_number(from.abort);
    to.value = from.bytes;
    append_way(to, from);
    append(to, pack_number(from.service), 1);
    append_object(to, from);
    append(to, from.connection, 4);
  }
  static void unpack(const EventFields& from, event::RoutingEnded& to) {
    FieldReader data(from.bytes());
    unpack_number(from.code, to.abort);
    to.bytes = from.value;
    read_way(data, to);
    to.service = data.number<event::SdoService>();
    read_object(data, to);
    to.connection = data.number<std::uint32_t>();
  }
};

// code: number of suppressed events; data: source network (2; 0 = the gateway itself), target
// network (2), target node (1), way (1), index (2), sub-index (1).
template <>
struct EventCodec<event::RoutingUnanswered> {
  static constexpr v1::EventKind kKind = v1::EVENT_ROUTING_UNANSWERED;
  static void pack(const event::RoutingUnanswered& from, EventFields& to) {
    to.code = from.suppressed;
    append(to, from.source, 2);
    append(to, from.target, 2);
    append(to, from.target_node, 1);
    append(to, from.interface, 1);
    append_object(to, from);
  }
  static void unpack(const EventFields& from, event::RoutingUnanswered& to) {
    FieldReader data(from.bytes());
    to.suppressed = from.code;
    to.source = data.number<std::uint16_t>();
    to.target = data.number<std::uint16_t>();
    to.target_node = data.number<std::uint8_t>();
    to.interface = data.number<std::uint8_t>();
    read_object(data, to);
  }
};

// code: phase; value: phase before; data: cause (1).
template <>
struct EventCodec<event::SleepState> {
  static constexpr v1::EventKind kKind = v1::EVENT_SLEEP_STATE;
  static void pack(const event::SleepState& from, EventFields& to) {
    to.code = pack_number(from.phase);
    to.value = pack_number(from.before);
    append(to, pack_number(from.cause), 1);
  }
  static void unpack(const EventFields& from, event::SleepState& to) {
    FieldReader data(from.bytes());
    unpack_number(from.code, to.phase);
    unpack_number(from.value, to.before);
    to.cause = data.number<nmt::SleepCause>();
  }
};

// code: number of the SRDO; value: fault, 0 = valid; data: number of suppressed events (4).
template <>
struct EventCodec<event::SrdoState> {
  static constexpr v1::EventKind kKind = v1::EVENT_SRDO_STATE;
  static void pack(const event::SrdoState& from, EventFields& to) {
    to.code = from.number;
    to.value = pack_number(from.fault);
    append(to, from.suppressed, 4);
  }
  static void unpack(const EventFields& from, event::SrdoState& to) {
    FieldReader data(from.bytes());
    unpack_number(from.code, to.number);
    unpack_number(from.value, to.fault);
    to.suppressed = data.number<std::uint32_t>();
  }
};

// code: SDO abort code, 0 = none; value: result; data: number (4), node-IDs of client and server,
// objects of client and server (2 each), CAN-IDs from client to server and back (2 each).
template <>
struct EventCodec<event::SdoConnection> {
  static constexpr v1::EventKind kKind = v1::EVENT_SDO_CONNECTION;
  static void pack(const event::SdoConnection& from, EventFields& to) {
    to.code = pack_number(from.abort);
    to.value = pack_number(from.result);
    append(to, from.number, 4);
    append(to, from.client, 1);
    append(to, from.server, 1);
    append(to, from.client_record, 2);
    append(to, from.server_record, 2);
    append(to, from.request, 2);
    append(to, from.response, 2);
  }
  static void unpack(const EventFields& from, event::SdoConnection& to) {
    FieldReader data(from.bytes());
    unpack_number(from.code, to.abort);
    unpack_number(from.value, to.result);
    to.number = data.number<std::uint32_t>();
    to.client = data.number<std::uint8_t>();
    to.server = data.number<std::uint8_t>();
    to.client_record = data.number<std::uint16_t>();
    to.server_record = data.number<std::uint16_t>();
    to.request = data.number<std::uint16_t>();
    to.response = data.number<std::uint16_t>();
  }
};

// --- the gateway ---------------------------------------------------------------------------------

// value: number of lines.
template <>
struct EventCodec<event::GatewayStarted> {
  static constexpr v1::EventKind kKind = v1::EVENT_GATEWAY_STARTED;
  static void pack(const event::GatewayStarted& from, EventFields& to) { to.value = from.lines; }
  static void unpack(const EventFields& from, event::GatewayStarted& to) { to.lines = from.value; }
};

// code: number of lines started, stopped or replaced; value: number of lines now.
template <>
struct EventCodec<event::GatewayReloaded> {
  static constexpr v1::EventKind kKind = v1::EVENT_GATEWAY_RELOADED;
  static void pack(const event::GatewayReloaded& from, EventFields& to) {
    to.code = from.changed;
    to.value = from.lines;
  }
  static void unpack(const EventFields& from, event::GatewayReloaded& to) {
    to.changed = from.code;
    to.lines = from.value;
  }
};

// value: number of errors.
template <>
struct EventCodec<event::GatewayReloadRefused> {
  static constexpr v1::EventKind kKind = v1::EVENT_GATEWAY_RELOAD_REFUSED;
  static void pack(const event::GatewayReloadRefused& from, EventFields& to) {
    to.value = from.errors;
  }
  static void unpack(const EventFields& from, event::GatewayReloadRefused& to) {
    to.errors = from.value;
  }
};

// code: condition; value: number of missing events; data: extended result code of SQLite (4).
template <>
struct EventCodec<event::JournalState> {
  static constexpr v1::EventKind kKind = v1::EVENT_JOURNAL_STATE;
  static void pack(const event::JournalState& from, EventFields& to) {
    to.code = pack_number(from.condition);
    to.value = from.lost;
    append(to, from.error, 4);
  }
  static void unpack(const EventFields& from, event::JournalState& to) {
    FieldReader data(from.bytes());
    unpack_number(from.code, to.condition);
    to.lost = from.value;
    to.error = data.number<std::uint32_t>();
  }
};

// code: cause; value: exit code, signal or error number; data: ends (4), pause in ms (4), process
// (1).
template <>
struct EventCodec<event::DdsProcessEnded> {
  static constexpr v1::EventKind kKind = v1::EVENT_DDS_PROCESS_ENDED;
  static void pack(const event::DdsProcessEnded& from, EventFields& to) {
    to.code = pack_number(from.cause);
    to.value = from.detail;
    append(to, from.ends, 4);
    append(to, from.pause_ms, 4);
    append(to, pack_number(from.process), 1);
  }
  static void unpack(const EventFields& from, event::DdsProcessEnded& to) {
    FieldReader data(from.bytes());
    unpack_number(from.code, to.cause);
    to.detail = from.value;
    to.ends = data.number<std::uint32_t>();
    to.pause_ms = data.number<std::uint32_t>();
    to.process = data.number<event::DdsProcess>();
  }
};

// The numbers of the stack are those of the contract.
template <class... Data>
constexpr bool same_event_numbers(std::type_identity<std::variant<Data...>> /*of*/) {
  return ((static_cast<unsigned>(EventCodec<Data>::kKind) == static_cast<unsigned>(Data::kKind)) &&
          ...);
}
static_assert(same_event_numbers(std::type_identity<EventData>{}));

template <class Data>
EventCodec<std::remove_cvref_t<Data>> event_codec_of(const Data& /*data*/) {
  return {};
}

}  // namespace

EventFields pack(const EventData& data) {
  EventFields out;
  std::visit([&out](const auto& from) { event_codec_of(from).pack(from, out); }, data);
  return out;
}

std::optional<EventData> unpack(EventKind kind, const EventFields& fields) {
  if (static_cast<std::size_t>(kind) >= kEventKinds)
    return std::nullopt;
  EventData out = empty_event_data(kind);
  std::visit([&fields](auto& to) { event_codec_of(to).unpack(fields, to); }, out);
  return out;
}

}  // namespace linegate::dds
