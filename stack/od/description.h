// SPDX-License-Identifier: Apache-2.0
// A device as its file (EDS, DCF) describes it: plain values, from which a Dictionary is built.
#pragma once

#include <compare>
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
#include "stack/od/scaling.h"

namespace linegate::od {

struct Address {
  std::uint16_t index = 0;
  std::uint8_t sub = 0;

  friend constexpr auto operator<=>(Address, Address) = default;
};

// CiA 306 AccessType. rwr and rww restrict the PDOs that an rw object may be mapped into.
enum class Access : std::uint8_t { ro, wo, rw, rwr, rww, constant };

constexpr bool readable(Access access) {
  return access != Access::wo;
}
constexpr bool writable(Access access) {
  return access != Access::ro && access != Access::constant;
}
// Whether the access right permits mapping into a TPDO (sent by the device) or an RPDO (received by
// the device), provided that the object permits PDO mapping at all.
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

// Attributes of a value in a device file that do not become part of a Dictionary.
struct FileNotes {
  // Whether the file gives the value, the limits and the default as $NODEID + a number.
  bool value_formula = false;
  bool default_formula = false;
  bool low_formula = false;
  bool high_formula = false;
  std::vector<std::byte> default_value;  // the DefaultValue of a configured value
  std::string denotation;                // DCF: the name of the value in this application
  std::string reference;                 // DCF: ParamRefd, a designator of the plant
  std::string upload_file;               // DCF: file for the value read from the device
  std::string download_file;             // DCF: file with the value to write

  friend bool operator==(const FileNotes&, const FileNotes&) = default;
};

struct VariableDescription {
  std::uint8_t sub = 0;
  std::string name;
  DataType type = DataType::none;
  Access access = Access::rw;
  bool mappable = false;
  bool store = false;                 // saved by 1010h (store parameters)
  std::vector<std::byte> value;       // initial value, little-endian, node-ID already applied
  std::vector<std::byte> low_limit;   // empty = none
  std::vector<std::byte> high_limit;  // empty = none
  bool configured = false;            // the value is a DCF's ParameterValue, not a default
  bool overridden = false;            // the value is from a configuration that supplements the file
  std::uint32_t line = 0;             // line in the source file, 0 = none
  std::string alias;                  // its name in the image, if not that of the file
  Scaling scaling;                    // for people: values and limits here are not scaled
  FileNotes notes;

  friend bool operator==(const VariableDescription&, const VariableDescription&) = default;
};

struct ObjectDescription {
  std::uint16_t index = 0;
  std::string name;
  ObjectType type = ObjectType::variable;
  std::vector<VariableDescription> variables;  // ascending by sub; gaps are allowed
  std::uint32_t line = 0;
  // CiA 306 ObjFlags. Bit 0: not written when the device is configured; bit 1: not read when all
  // objects are read.
  std::uint32_t flags = 0;
  std::string denotation;  // DCF; for objects with sub-indices

  friend bool operator==(const ObjectDescription&, const ObjectDescription&) = default;
};

struct DeviceDescription {
  std::string file;
  std::string vendor_name;
  std::string product_name;
  std::uint32_t vendor_number = 0;
  std::uint32_t product_number = 0;
  std::uint32_t revision_number = 0;
  bool dynamic_mapping = true;    // Granularity is not 0
  std::uint32_t dummy_types = 0;  // DummyUsage: bit n = data type n may be a dummy entry in RPDOs
  std::uint8_t node_id = 0;       // 1..127: node-ID used to resolve the formulas
  std::string node_name;          // DCF commissioning
  std::vector<ObjectDescription> objects;  // ascending by index

  friend bool operator==(const DeviceDescription&, const DeviceDescription&) = default;

  // nullptr if there is no such object or sub-index.
  const ObjectDescription* find(std::uint16_t index) const;
  const VariableDescription* find(Address address) const;
  VariableDescription* find(Address address);
};

// The address as text: "6200:0A", index and sub-index hexadecimal with four and two digits, as in
// CiA documents. All commands print and parse this notation.
std::string to_text(Address address);

// Parses "6200:0A", "6200:A", "0x6200:0x0A"; "6200" means sub-index 0. Upper or lower case. Returns
// nothing for other texts or if a number is out of range.
std::optional<Address> parse_address(std::string_view text);

// The two parts of an address as separate texts.
std::optional<std::uint16_t> parse_index(std::string_view text);
std::optional<std::uint8_t> parse_sub(std::string_view text);

// The description with another node-ID. Values, limits and defaults that the file gives as $NODEID
// + a number follow the node-ID (1..127).
DeviceDescription with_node_id(DeviceDescription device, std::uint8_t node_id);

// A sub-index for an object of our own, which no file describes, with a number as its default
// value. Precondition: the type has a fixed size of at most 8 bytes; or it has none, like DOMAIN,
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

// A VAR with its name and type from the catalogue (objects.h). Precondition: the catalogue has the
// index as a VAR with a number.
ObjectDescription catalogued_variable(std::uint16_t index, Access access, std::uint64_t value = 0);

// 1018h with its four sub-indices (CiA 301, 7.5.2.21).
ObjectDescription identity_object(std::uint32_t vendor = 0, std::uint32_t product = 0,
                                  std::uint32_t revision = 0, std::uint32_t serial = 0);

}  // namespace linegate::od
