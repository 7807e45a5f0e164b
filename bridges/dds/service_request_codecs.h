// SPDX-License-Identifier: Apache-2.0
// Codecs of all other requests: process data, the network, frames. Private to request_codec.cpp.
#pragma once

#include <algorithm>
#include <cstdint>
#include <span>
#include <string>
#include <utility>

#include "bridges/dds/request_codec_parts.h"

namespace linegate::dds {

inline constexpr std::uint32_t kExtendedBit = 0x8000'0000;
inline constexpr std::uint32_t kRemoteBit = 0x4000'0000;
inline constexpr std::uint8_t kFdSub = 4;  // of COMMAND_CAN_SEND
inline constexpr std::uint8_t kSwitchedFdSub = 5;
inline constexpr std::uint32_t kNoByte = 0xFFFF'FFFF;  // entry of COMMAND_PDO_TRIGGER

template <>
struct RequestCodec<line::SingleOutput> {
  static constexpr v1::CommandKind kKind = v1::COMMAND_OUTPUT_WRITE;
  static void write(const line::SingleOutput& from, v1::CommandRequest& to) {
    to.entry(from.entry);
  }
  static const char* read(const v1::CommandRequest& from, line::SingleOutput& to) {
    to.entry = from.entry();
    return nullptr;
  }
  static Bytes encode(const line::SingleOutput& from) { return from.data; }
  static const char* decode(Bytes data, line::SingleOutput& to) {
    to.data = std::move(data);
    return to.data.empty() || to.data.size() > 8 ? "data is not 1 to 8 bytes" : nullptr;
  }
};

template <>
struct RequestCodec<line::EmcySend> {
  static constexpr v1::CommandKind kKind = v1::COMMAND_EMCY_SEND;
  static void write(const line::EmcySend& from, v1::CommandRequest& to) {
    to.node(from.node);
    to.code(from.code);
    to.error_register(from.error_register);
  }
  static const char* read(const v1::CommandRequest& from, line::EmcySend& to) {
    to.node = from.node();
    to.code = from.code();
    to.error_register = from.error_register();
    return nullptr;
  }
  static Bytes encode(const line::EmcySend& from) {
    return {from.manufacturer.begin(), from.manufacturer.end()};
  }
  static const char* decode(const Bytes& data, line::EmcySend& to) {
    if (data.size() > to.manufacturer.size())
      return "data is more than 5 manufacturer bytes";
    std::ranges::copy(data, to.manufacturer.begin());
    return nullptr;
  }
};

template <>
struct RequestCodec<line::NmtRequest> : WithoutData {
  static constexpr v1::CommandKind kKind = v1::COMMAND_NMT;
  static void write(const line::NmtRequest& from, v1::CommandRequest& to) {
    to.node(from.node);
    to.nmt(static_cast<std::uint8_t>(from.command));
  }
  static const char* read(const v1::CommandRequest& from, line::NmtRequest& to) {
    to.node = from.node();
    to.command = static_cast<nmt::Command>(from.nmt());
    const char* const why = node_or_all(to.node);
    return why != nullptr || nmt::is_command(from.nmt()) ? why : "nmt is not a command specifier";
  }
};

template <>
struct RequestCodec<line::SleepRequest> : WithoutData {
  static constexpr v1::CommandKind kKind = v1::COMMAND_SLEEP;
  static void write(const line::SleepRequest& from, v1::CommandRequest& to) {
    to.code(static_cast<std::uint16_t>(from.action));
  }
  static const char* read(const v1::CommandRequest& from, line::SleepRequest& to) {
    to.action = static_cast<line::SleepAction>(from.code());
    return from.code() < line::kSleepActions ? nullptr : "code is not 0 to 5";
  }
};

template <>
struct RequestCodec<line::RoutingTrace> : WithoutData {
  static constexpr v1::CommandKind kKind = v1::COMMAND_ROUTING_TRACE;
  static void write(const line::RoutingTrace& from, v1::CommandRequest& to) {
    to.code(static_cast<std::uint16_t>(from.duration.count()));
  }
  static const char* read(const v1::CommandRequest& from, line::RoutingTrace& to) {
    to.duration = std::chrono::seconds(from.code());
    return nullptr;
  }
};

template <>
struct RequestCodec<line::Scan> : WithNodeOrAll, WithoutData {
  static constexpr v1::CommandKind kKind = v1::COMMAND_SCAN;
};
template <>
struct RequestCodec<line::Boot> : WithNodeOrAll, WithoutData {
  static constexpr v1::CommandKind kKind = v1::COMMAND_BOOT;
};

template <>
struct RequestCodec<line::ScanApply> : WithoutData {
  static constexpr v1::CommandKind kKind = v1::COMMAND_SCAN_APPLY;
  static void write(const line::ScanApply& from, v1::CommandRequest& to) {
    to.node(from.node);
    to.code(static_cast<std::uint16_t>((from.set_up ? v1::SCAN_SET_UP : 0U) |
                                       (from.restore ? v1::SCAN_RESTORE : 0U)));
  }
  static const char* read(const v1::CommandRequest& from, line::ScanApply& to) {
    to.node = from.node();
    to.set_up = (from.code() & v1::SCAN_SET_UP) != 0;
    to.restore = (from.code() & v1::SCAN_RESTORE) != 0;
    if (from.code() > (v1::SCAN_SET_UP | v1::SCAN_RESTORE))
      return "code has other bits than SCAN_SET_UP and SCAN_RESTORE";
    return node_or_all(to.node);
  }
};

template <>
struct RequestCodec<line::Configure> : WithoutData {
  static constexpr v1::CommandKind kKind = v1::COMMAND_CONFIGURE;
  static void write(const line::Configure& from, v1::CommandRequest& to) {
    to.node(from.node);
    to.code(from.apply ? 1 : 0);
  }
  static const char* read(const v1::CommandRequest& from, line::Configure& to) {
    to.node = from.node();
    to.apply = from.code() == 1;
    return from.code() > 1 ? "code is not 0 or 1" : node_or_all(to.node);
  }
};

template <>
struct RequestCodec<line::ProgramDownload> {
  static constexpr v1::CommandKind kKind = v1::COMMAND_PROGRAM;
  static void write(const line::ProgramDownload& from, v1::CommandRequest& to) {
    to.node(from.node);
    to.sub(from.number);
  }
  static const char* read(const v1::CommandRequest& from, line::ProgramDownload& to) {
    to.node = from.node();
    to.number = from.sub();
    return to.number == 0 ? "sub is not 1..255" : one_node(to.node);
  }
  static Bytes encode(const line::ProgramDownload& from) { return from.program; }
  static const char* decode(Bytes data, line::ProgramDownload& to) {
    to.program = std::move(data);
    return to.program.empty() ? "there are no data to write" : nullptr;
  }
};

template <>
struct RequestCodec<line::LssRequest> {
  static constexpr v1::CommandKind kKind = v1::COMMAND_LSS;
  static void write(const line::LssRequest& from, v1::CommandRequest& to) {
    to.code(static_cast<std::uint16_t>(from.procedure));
  }
  static const char* read(const v1::CommandRequest& from, line::LssRequest& to) {
    to.procedure = static_cast<lss::Procedure>(from.code());
    return from.code() >= lss::kProcedures ? "code is no LSS service" : nullptr;
  }
  static Bytes encode(const line::LssRequest& from) { return from.arguments; }
  static const char* decode(Bytes data, line::LssRequest& to) {
    constexpr std::size_t kLongest = 24;
    to.arguments = std::move(data);
    return to.arguments.size() > kLongest ? "data is more than the arguments of an LSS service"
                                          : nullptr;
  }
};

template <>
struct RequestCodec<line::PdoTrigger> : WithoutData {
  static constexpr v1::CommandKind kKind = v1::COMMAND_PDO_TRIGGER;
  static void write(const line::PdoTrigger& from, v1::CommandRequest& to) {
    to.node(from.node);
    to.code(from.number);
    // Without node, number and byte: no PDO, as in the stack. Byte 0 would be one of the outputs.
    const bool names_none = from.node == 0 && from.number == 0 && !from.output_byte;
    to.entry(names_none ? kNoByte : from.output_byte.value_or(0));
  }
  static const char* read(const v1::CommandRequest& from, line::PdoTrigger& to) {
    to.node = from.node();
    to.number = from.code();
    if (to.node == 0 && to.number == 0)
      to.output_byte = from.entry();
    return node_or_all(to.node);
  }
};

template <>
struct RequestCodec<line::PdoRequest> : WithoutData {
  static constexpr v1::CommandKind kKind = v1::COMMAND_PDO_REQUEST;
  static void write(const line::PdoRequest& from, v1::CommandRequest& to) {
    to.node(from.node);
    to.code(from.number);
  }
  static const char* read(const v1::CommandRequest& from, line::PdoRequest& to) {
    to.node = from.node();
    to.number = from.code();
    return node_or_all(to.node);
  }
};

template <>
struct RequestCodec<line::MpdoWrite> {
  static constexpr v1::CommandKind kKind = v1::COMMAND_MPDO_WRITE;
  static void write(const line::MpdoWrite& from, v1::CommandRequest& to) {
    to.node(from.node);
    set_address(from.address, to);
    to.code(from.tpdo);
  }
  static const char* read(const v1::CommandRequest& from, line::MpdoWrite& to) {
    to.node = from.node();
    to.address = address_of(from);
    to.tpdo = from.code();
    return node_or_all(to.node);
  }
  static Bytes encode(const line::MpdoWrite& from) { return from.data; }
  static const char* decode(Bytes data, line::MpdoWrite& to) {
    to.data = std::move(data);
    return to.data.empty() || to.data.size() > 4 ? "data is not 1 to 4 bytes" : nullptr;
  }
};

template <>
struct RequestCodec<line::ConnectionOpen> : WithoutData {
  static constexpr v1::CommandKind kKind = v1::COMMAND_CONNECTION_OPEN;
  static void write(const line::ConnectionOpen& from, v1::CommandRequest& to) {
    to.node(from.node);
    to.code(from.server);
  }
  static const char* read(const v1::CommandRequest& from, line::ConnectionOpen& to) {
    if (from.code() < can::kMinNodeId || from.code() > can::kMaxNodeId)
      return "code is not 1..127";
    to.node = from.node();
    to.server = static_cast<std::uint8_t>(from.code());
    return one_node(to.node);
  }
};

template <>
struct RequestCodec<line::ConnectionClose> : WithoutData {
  static constexpr v1::CommandKind kKind = v1::COMMAND_CONNECTION_CLOSE;
  static void write(const line::ConnectionClose& from, v1::CommandRequest& to) {
    to.entry(from.number);
  }
  static const char* read(const v1::CommandRequest& from, line::ConnectionClose& to) {
    to.number = from.entry();
    return nullptr;
  }
};

template <>
struct RequestCodec<line::ConnectionList> : WithoutMembers, WithoutData {
  static constexpr v1::CommandKind kKind = v1::COMMAND_CONNECTION_LIST;
};

template <>
struct RequestCodec<line::CanSend> {
  static constexpr v1::CommandKind kKind = v1::COMMAND_CAN_SEND;
  static void write(const line::CanSend& from, v1::CommandRequest& to) {
    const can::Frame& frame = from.frame;
    const bool switches = (frame.flags & can::Frame::kBitRateSwitch) != 0;
    to.entry(frame.id | (frame.extended() ? kExtendedBit : 0U) |
             (frame.remote() ? kRemoteBit : 0U));
    to.sub(!frame.fd() ? std::uint8_t{0} : switches ? kSwitchedFdSub : kFdSub);
    to.code(frame.remote() ? frame.length : std::uint16_t{0});
  }
  static const char* read(const v1::CommandRequest& from, line::CanSend& to) {
    const bool extended = (from.entry() & kExtendedBit) != 0;
    const bool remote = (from.entry() & kRemoteBit) != 0;
    const bool fd = from.sub() != 0;
    const bool switches = from.sub() == kSwitchedFdSub;
    to.frame.id = from.entry() & ~(kExtendedBit | kRemoteBit);
    to.frame.flags = static_cast<std::uint8_t>(
        (extended ? can::Frame::kExtended : 0) | (remote ? can::Frame::kRemote : 0) |
        (fd ? can::Frame::kFd : 0) | (switches ? can::Frame::kBitRateSwitch : 0));
    if (fd && !switches && from.sub() != kFdSub)
      return "sub is not 0, 4 or 5";
    if (from.code() > (remote ? can::kMaxClassicData : 0))
      return "code is no length of a remote frame";
    to.frame.length = static_cast<std::uint8_t>(from.code());
    return nullptr;
  }
  static Bytes encode(const line::CanSend& from) {
    const auto data = from.frame.remote() ? std::span<const std::byte>() : from.frame.bytes();
    return {data.begin(), data.end()};
  }
  static const char* decode(const Bytes& data, line::CanSend& to) {
    if (data.size() > to.frame.data.size())
      return "data is more than 64 bytes";
    if (to.frame.remote())
      return data.empty() ? nullptr : "a remote frame has no data";
    to.frame.length = static_cast<std::uint8_t>(data.size());
    std::ranges::copy(data, to.frame.data.begin());
    return nullptr;
  }
};

template <>
struct RequestCodec<line::CanListen> {
  static constexpr v1::CommandKind kKind = v1::COMMAND_CAN_LISTEN;
  static void write(const line::CanListen& from, v1::CommandRequest& to) {
    to.code(static_cast<std::uint16_t>(from.duration.count()));
    to.entry(from.identifier | (from.extended.value_or(false) ? kExtendedBit : 0U));
  }
  static const char* read(const v1::CommandRequest& from, line::CanListen& to) {
    to.duration = std::chrono::seconds(from.code());
    to.identifier = from.entry() & line::CanListen::kAllBits;
    to.extended = (from.entry() & kExtendedBit) != 0;
    return (from.entry() & ~(line::CanListen::kAllBits | kExtendedBit)) != 0
               ? "entry is no identifier"
               : nullptr;
  }
  static Bytes encode(const line::CanListen& from) {
    if (from.mask == line::CanListen::kAllBits && from.extended)
      return {};
    FieldWriter out;
    out.number(from.mask | (from.extended ? kExtendedBit : 0U), 4);
    return out.take();
  }
  static const char* decode(const Bytes& data, line::CanListen& to) {
    if (data.empty())
      return nullptr;
    if (data.size() != 4)
      return "data is no mask of 4 bytes";
    const auto mask = load_le<std::uint32_t>(data.data());
    to.mask = mask & line::CanListen::kAllBits;
    if ((mask & kExtendedBit) == 0)
      to.extended.reset();
    return nullptr;
  }
};

template <>
struct RequestCodec<request::Versions> : WithoutMembers, WithoutData {
  static constexpr v1::CommandKind kKind = v1::COMMAND_VERSIONS;
};
template <>
struct RequestCodec<request::BusRestart> : WithoutMembers, WithoutData {
  static constexpr v1::CommandKind kKind = v1::COMMAND_BUS_RESTART;
};

template <>
struct RequestCodec<request::BusFault> : WithoutMembers {
  static constexpr v1::CommandKind kKind = v1::COMMAND_BUS_FAULT;
  static Bytes encode(const request::BusFault& from) {
    const auto text = std::as_bytes(std::span(from.change));
    return {text.begin(), text.end()};
  }
  static const char* decode(const Bytes& data, request::BusFault& to) {
    to.change.assign(reinterpret_cast<const char*>(data.data()), data.size());
    return data.size() > 256 ? "data is more than 256 bytes of text" : nullptr;
  }
};

template <>
struct RequestCodec<request::JournalRead> {
  static constexpr v1::CommandKind kKind = v1::COMMAND_JOURNAL_READ;
  static void write(const request::JournalRead& from, v1::CommandRequest& to) {
    to.entry(from.most);
  }
  static const char* read(const v1::CommandRequest& from, request::JournalRead& to) {
    to.most = from.entry();
    return from.code() == 0 ? nullptr : "code is not 0";
  }
  static Bytes encode(const request::JournalRead& from) { return request::encode(from); }
  static const char* decode(const Bytes& data, request::JournalRead& to) {
    return request::decode(data, to);
  }
};

}  // namespace linegate::dds
