// SPDX-License-Identifier: Apache-2.0
// Codecs of requests that read, write or create objects. Private to request_codec.cpp.
#pragma once

#include <cstdint>
#include <utility>

#include "bridges/dds/request_codec_parts.h"

namespace linegate::dds {

inline constexpr std::uint32_t kFromImageBit = 1;  // code of COMMAND_SDO_READ
inline constexpr std::uint32_t kFromScanBit = 2;
inline constexpr std::uint16_t kListCode = 2;     // of COMMAND_LOCAL_READ
inline constexpr std::uint16_t kForceSdoBit = 1;  // code of COMMAND_OBJECT_WRITE
inline constexpr std::uint16_t kKeepPdoBit = 2;

template <>
struct RequestCodec<line::SdoRead> : WithoutData {
  static constexpr v1::CommandKind kKind = v1::COMMAND_SDO_READ;
  static void write(const line::SdoRead& from, v1::CommandRequest& to) {
    to.node(from.node);
    set_address(from.address, to);
    to.code(static_cast<std::uint16_t>((from.from_image ? kFromImageBit : 0U) |
                                       (from.from_scan ? kFromScanBit : 0U)));
  }
  static const char* read(const v1::CommandRequest& from, line::SdoRead& to) {
    to.node = from.node();
    to.address = address_of(from);
    to.from_image = (from.code() & kFromImageBit) != 0;
    to.from_scan = (from.code() & kFromScanBit) != 0;
    if (from.code() > (kFromImageBit | kFromScanBit))
      return "code has other bits than 0 and 1";
    return one_node(to.node);
  }
};

template <>
struct RequestCodec<line::SdoWrite> : WithValue {
  static constexpr v1::CommandKind kKind = v1::COMMAND_SDO_WRITE;
  static void write(const line::SdoWrite& from, v1::CommandRequest& to) {
    to.node(from.node);
    set_address(from.address, to);
  }
  static const char* read(const v1::CommandRequest& from, line::SdoWrite& to) {
    to.node = from.node();
    to.address = address_of(from);
    return one_node(to.node);
  }
};

inline constexpr std::uint32_t kAsDeviceBit = 1;  // entry of COMMAND_NETWORK_READ and _WRITE
inline constexpr unsigned kHopsShift = 8;
inline constexpr std::uint32_t kMostHops = 0xFF;

struct InNetwork {
  template <class Request>
  static void write(const Request& from, v1::CommandRequest& to) {
    to.code(from.network);
    to.node(from.node);
    set_address(from.address, to);
    to.entry((from.as_device ? kAsDeviceBit : 0U) | std::uint32_t{from.hops} << kHopsShift);
  }
  template <class Request>
  static const char* read(const v1::CommandRequest& from, Request& to) {
    to.network = from.code();
    to.node = from.node();
    to.address = address_of(from);
    to.as_device = (from.entry() & kAsDeviceBit) != 0;
    to.hops = static_cast<std::uint8_t>(from.entry() >> kHopsShift);
    if (to.network == 0)
      return "code is no network-ID";
    if ((from.entry() & ~(kAsDeviceBit | kMostHops << kHopsShift)) != 0)
      return "entry has other bits than 0 and 8 to 15";
    return one_node(to.node);
  }
};
template <>
struct RequestCodec<line::NetworkRead> : InNetwork, WithoutData {
  static constexpr v1::CommandKind kKind = v1::COMMAND_NETWORK_READ;
};
template <>
struct RequestCodec<line::NetworkWrite> : InNetwork, WithValue {
  static constexpr v1::CommandKind kKind = v1::COMMAND_NETWORK_WRITE;
};

template <>
struct RequestCodec<line::ObjectWrite> : WithValue {
  static constexpr v1::CommandKind kKind = v1::COMMAND_OBJECT_WRITE;
  static void write(const line::ObjectWrite& from, v1::CommandRequest& to) {
    to.node(from.node);
    set_address(from.address, to);
    to.code(static_cast<std::uint16_t>((from.force_sdo ? kForceSdoBit : 0U) |
                                       (from.keep_pdo ? kKeepPdoBit : 0U)));
  }
  static const char* read(const v1::CommandRequest& from, line::ObjectWrite& to) {
    to.node = from.node();
    to.address = address_of(from);
    to.force_sdo = (from.code() & kForceSdoBit) != 0;
    to.keep_pdo = (from.code() & kKeepPdoBit) != 0;
    if (from.code() > (kForceSdoBit | kKeepPdoBit))
      return "code has other bits than 0 and 1";
    return one_node(to.node);
  }
};

template <>
struct RequestCodec<line::LocalRead> : WithoutData {
  static constexpr v1::CommandKind kKind = v1::COMMAND_LOCAL_READ;
  static void write(const line::LocalRead& from, v1::CommandRequest& to) {
    to.node(from.node);
    if (const auto* const range = std::get_if<line::ObjectRange>(&from.what)) {
      to.code(kListCode);
      to.index(range->first);
      to.entry(range->last);
    } else {
      set_address(std::get<od::Address>(from.what), to);
    }
  }
  static const char* read(const v1::CommandRequest& from, line::LocalRead& to) {
    to.node = from.node();
    to.what = address_of(from);
    if ((from.code() & kListCode) != 0) {
      const bool to_end = from.entry() == 0 || from.entry() > 0xFFFF;
      const std::uint32_t last = to_end ? 0xFFFF : from.entry();
      to.what = line::ObjectRange{from.index(), static_cast<std::uint16_t>(last)};
    }
    return from.code() == 0 || from.code() == kListCode ? nullptr : "code is not 0 or 2";
  }
};

template <>
struct RequestCodec<line::LocalWrite> : WithValue {
  static constexpr v1::CommandKind kKind = v1::COMMAND_LOCAL_WRITE;
  static void write(const line::LocalWrite& from, v1::CommandRequest& to) {
    to.node(from.node);
    set_address(from.address, to);
    to.code(from.as_owner ? v1::LOCAL_WRITE_OWN : std::uint16_t{0});
  }
  static const char* read(const v1::CommandRequest& from, line::LocalWrite& to) {
    to.node = from.node();
    to.address = address_of(from);
    to.as_owner = from.code() == v1::LOCAL_WRITE_OWN;
    return from.code() > v1::LOCAL_WRITE_OWN ? "code is not 0 or LOCAL_WRITE_OWN" : nullptr;
  }
};

template <>
struct RequestCodec<line::ObjectCreate> {
  static constexpr v1::CommandKind kKind = v1::COMMAND_OBJECT_CREATE;

  static constexpr unsigned kMappable = 1;
  static constexpr unsigned kStored = 2;
  static constexpr unsigned kPlaced = 4;

  static void write(const line::ObjectCreate& from, v1::CommandRequest& to) {
    if (const auto* const removal = std::get_if<line::ObjectRemoval>(&from.what)) {
      to.code(1);
      to.index(removal->index);
      return;
    }
    const auto& object = std::get<line::OwnObject>(from.what);
    set_address({object.index, object.variable.sub}, to);
    to.entry(object.offset);
  }
  static const char* read(const v1::CommandRequest& from, line::ObjectCreate& to) {
    if (from.code() == 1) {
      to.what = line::ObjectRemoval{from.index()};
      return nullptr;
    }
    line::OwnObject object{.index = from.index(), .offset = from.entry()};
    object.variable.sub = from.sub();
    to.what = std::move(object);
    return from.code() > 1 ? "code is not 0 or 1" : nullptr;
  }
  static bool is_defined(od::DataType type) {
    using od::DataType;
    return od::has_fixed_size(type) || od::is_string(type) || type == DataType::time_of_day ||
           type == DataType::time_difference || type == DataType::domain;
  }
  static Bytes encode(const line::ObjectCreate& from) {
    const auto* const object = std::get_if<line::OwnObject>(&from.what);
    if (object == nullptr)
      return {};
    const od::VariableDescription& variable = object->variable;
    FieldWriter out;
    out.number(static_cast<std::uint16_t>(variable.type), 2);
    out.number(static_cast<std::uint8_t>(variable.access), 1);
    out.number((variable.mappable ? kMappable : 0U) | (variable.store ? kStored : 0U) |
                   (object->in_image ? kPlaced : 0U),
               1);
    out.sized(variable.name, 1);
    out.sized(variable.value, 1);
    out.sized(variable.low_limit, 1);
    out.sized(variable.high_limit, 1);
    return out.take();
  }
  static const char* decode(const Bytes& data, line::ObjectCreate& to) {
    auto* const object = std::get_if<line::OwnObject>(&to.what);
    if (object == nullptr)
      return nullptr;
    FieldReader in(data);
    od::VariableDescription& variable = object->variable;
    variable.type = static_cast<od::DataType>(in.number<std::uint16_t>());
    variable.access = static_cast<od::Access>(in.number<std::uint8_t>());
    const auto flags = in.number<std::uint8_t>();
    variable.mappable = (flags & kMappable) != 0;
    variable.store = (flags & kStored) != 0;
    object->in_image = (flags & kPlaced) != 0;
    variable.name = in.text(1);
    variable.value = in.sized(1);
    variable.low_limit = in.sized(1);
    variable.high_limit = in.sized(1);
    const bool known =
        variable.access <= od::Access::constant && flags <= (kMappable | kStored | kPlaced);
    if (in.complete() && !is_defined(variable.type))
      return "data has a data type that CiA 301 does not define";
    return in.complete() && known ? nullptr : "data is no description of an object";
  }
};

}  // namespace linegate::dds
