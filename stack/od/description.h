// SPDX-License-Identifier: Apache-2.0
// A device as its file (EDS, DCF) describes it: plain values, from which a Dictionary is built.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "stack/base/assert.h"
#include "stack/base/byte_order.h"
#include "stack/od/data_type.h"

namespace linegate::od {

struct Address {
  std::uint16_t index = 0;
  std::uint8_t sub = 0;

  friend constexpr auto operator<=>(Address, Address) = default;
};

// CiA 306 AccessType. rwr and rww say which PDO an rw object may be mapped into.
enum class Access : std::uint8_t { ro, wo, rw, rwr, rww, constant };

constexpr bool readable(Access access) {
  return access != Access::wo;
}
constexpr bool writable(Access access) {
  return access != Access::ro && access != Access::constant;
}
// May be mapped into a TPDO (the device sends it) or an RPDO (the device receives it), given that
// PDO mapping is allowed at all.
constexpr bool tpdo_mappable(Access access) {
  return access != Access::wo && access != Access::rww;
}
constexpr bool rpdo_mappable(Access access) {
  return writable(access) && access != Access::rwr;
}

// CiA 301 object codes.
enum class ObjectType : std::uint8_t {
  null = 0,
  domain = 2,
  deftype = 5,
  defstruct = 6,
  variable = 7,
  array = 8,
  record = 9,
};

// What a device file says of a value beside the value; nothing of it reaches a Dictionary.
struct FileNotes {
  // Which values the file gives as $NODEID + a number.
  bool value_formula = false;
  bool default_formula = false;
  bool low_formula = false;
  bool high_formula = false;
  std::vector<std::byte> default_value;  // where the value is configured: the DefaultValue
  std::string denotation;                // DCF: what the value is called in this application
  std::string reference;                 // DCF: ParamRefd, a designator of the plant
  std::string upload_file;               // DCF: where the value read from the device is kept
  std::string download_file;             // DCF: holds the value to be written

  friend bool operator==(const FileNotes&, const FileNotes&) = default;
};

struct VariableDescription {
  std::uint8_t sub = 0;
  std::string name;
  DataType type = DataType::none;
  Access access = Access::rw;
  bool mappable = false;
  bool store = false;                 // 1010h shall save it
  std::vector<std::byte> value;       // initial value, little-endian, node-ID already applied
  std::vector<std::byte> low_limit;   // empty = none
  std::vector<std::byte> high_limit;  // empty = none
  bool configured = false;            // the value is a DCF's ParameterValue, not a default
  bool overridden = false;            // the value is that of a configuration beside the file
  std::uint32_t line = 0;             // in the file it came from, 0 = none
  FileNotes notes;

  friend bool operator==(const VariableDescription&, const VariableDescription&) = default;
};

struct ObjectDescription {
  std::uint16_t index = 0;
  std::string name;
  ObjectType type = ObjectType::variable;
  std::vector<VariableDescription> variables;  // ascending by sub; gaps are allowed
  std::uint32_t line = 0;
  // CiA 306 ObjFlags. Bit 0: not to be written when a device is configured; bit 1: not to be read
  // when all objects are.
  std::uint32_t flags = 0;
  std::string denotation;  // DCF; of objects with sub-indices

  friend bool operator==(const ObjectDescription&, const ObjectDescription&) = default;
};

struct DeviceDescription {
  std::string file;
  std::string vendor_name;
  std::string product_name;
  std::uint32_t vendor_number = 0;
  std::uint32_t product_number = 0;
  std::uint32_t revision_number = 0;
  bool dynamic_mapping = true;             // Granularity is not 0
  std::uint32_t dummy_types = 0;           // DummyUsage: bit n = data type n may fill RPDOs
  std::uint8_t node_id = 0;                // 1..127: the one the formulas were resolved with
  std::string node_name;                   // DCF commissioning
  std::vector<ObjectDescription> objects;  // ascending by index

  friend bool operator==(const DeviceDescription&, const DeviceDescription&) = default;

  // nullptr if there is no such object or sub-index.
  const ObjectDescription* find(std::uint16_t index) const;
  const VariableDescription* find(Address address) const;
  VariableDescription* find(Address address);
};

// An object as text: "6200:0A", index and sub-index hexadecimal with four and two digits, as CiA
// documents write them. What one command prints, all others read.
std::string to_text(Address address);

// "6200:0A", "6200:A", "0x6200:0x0A"; "6200" is sub-index 0. Upper or lower case. Nothing if the
// text is anything else, or a number is out of range.
std::optional<Address> parse_address(std::string_view text);

// The two parts, where they are given one by one.
std::optional<std::uint16_t> parse_index(std::string_view text);
std::optional<std::uint8_t> parse_sub(std::string_view text);

// The description with another node-ID. Values, limits and defaults that the file gives as $NODEID
// + a number follow the node-ID (1..127).
DeviceDescription with_node_id(DeviceDescription device, std::uint8_t node_id);

// For an object of our own, which no file describes: a sub-index with a number of that type as its
// default. Precondition: the type has a fixed size, of 8 bytes at most; or it has none, as DOMAIN,
// and the value is 0.
inline VariableDescription number_variable(std::uint8_t sub, std::string name, DataType type,
                                           Access access, std::uint64_t value = 0) {
  LINEGATE_ASSERT(byte_size(type) <= sizeof value && (byte_size(type) > 0 || value == 0),
                  "the type has room for the number");
  VariableDescription out;
  out.sub = sub;
  out.name = std::move(name);
  out.type = type;
  out.access = access;
  out.value.resize(byte_size(type));
  store_le(std::span<std::byte>(out.value), value);
  return out;
}

// A VAR with the name and the type that the catalogue has (objects.h). Precondition: it has the
// index, as a VAR with a number.
ObjectDescription catalogued_variable(std::uint16_t index, Access access, std::uint64_t value = 0);

// 1018h with its four sub-indices (CiA 301, 7.5.2.21).
ObjectDescription identity_object(std::uint32_t vendor = 0, std::uint32_t product = 0,
                                  std::uint32_t revision = 0, std::uint32_t serial = 0);

}  // namespace linegate::od
