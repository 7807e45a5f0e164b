// SPDX-License-Identifier: Apache-2.0
// The types of named topics: one struct for each device and direction of a line, with a member for
// each object in the process image. Made from the layout alone, when it is known.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "stack/image/layout.h"
#include "stack/od/data_type.h"
#include "stack/od/description.h"

namespace linegate::named {

// The type of a member in IDL.
enum class Form : std::uint8_t {
  boolean,
  int8,
  uint8,
  int16,
  uint16,
  int32,
  uint32,
  int64,
  uint64,
  float32,
  float64,
  text,   // UTF-8, without a zero
  octets  // an array
};

// How the value of a member follows from the bits of its entry.
enum class Reading : std::uint8_t {
  bits,         // an unsigned number, a real number, or octets as they are
  signed_bits,  // two's complement of as many bits as the entry has
  characters,   // VISIBLE_STRING: up to the first zero
  utf16,        // UNICODE_STRING: up to the first zero
  time_of_day,  // TIME_OF_DAY: nanoseconds since 1970 (CiA 301 7.1.6.5)
  duration      // TIME_DIFFERENCE: nanoseconds (CiA 301 7.1.6.6)
};

struct Member {
  std::string identifier;
  Form form = Form::uint8;
  Reading reading = Reading::bits;
  std::uint16_t length = 0;  // text: most octets of the value; octets: their number; else 0
  std::uint32_t entry = 0;   // in the layout
  std::uint32_t bit_offset = 0;
  std::uint16_t bit_length = 0;
  std::uint16_t pdo = 0;  // the device's; 0: none
  od::Address object{};
  od::DataType type = od::DataType::none;
  std::string object_name;  // without the name of the device
  // The member has the value in the PDO; these say what it means.
  od::Scaling scaling{};
  std::optional<double> low{};  // in the unit
  std::optional<double> high{};
};

// Of an output, the member of `waits`: 0 it is valid, 1 and above 1 + line::OutputWait, or that the
// gateway does not publish why it is not.
inline constexpr std::uint8_t kNoWait = 0;
inline constexpr std::uint8_t kUnknownWait = 255;

struct DeviceType {
  std::string line;
  std::string device;
  image::Direction direction = image::Direction::inputs;
  std::uint8_t node = 0;
  // Of the struct, in the module `plant`: line, device, direction and a hash of everything that a
  // reader must know to interpret a sample.
  std::string name;
  std::vector<Member> members;      // in the order of the layout, at least one
  std::vector<std::uint16_t> pdos;  // the device's PDOs that carry members, ascending
  bool ros2 = false;                // a message of ROS 2 (ros2_types.h): its topic has no key
  bool described = false;           // its writer describes it over DDS (described_type.h)

  // "plant::press_ram_inputs_..."; the name of the type in DDS.
  std::string type_name() const;
  // "plant/press/ram/inputs"
  std::string topic() const;
};

// Another identifier for an entry.
struct Alias {
  image::Direction direction = image::Direction::inputs;
  std::string entry;  // its name in the layout
  std::string identifier;

  friend bool operator==(const Alias&, const Alias&) = default;
};

struct DeviceTypes {
  std::vector<DeviceType> types;  // in the order of their first entries
  // A sentence for each entry whose identifier is that of an earlier one of its device, or has
  // none. Such a device has no type.
  std::vector<std::string> collisions;
};

DeviceTypes device_types(std::string_view line, const image::Layout& layout,
                         std::span<const Alias> aliases = {});

// The module of all types.
inline constexpr std::string_view kModule = "plant";

}  // namespace linegate::named
