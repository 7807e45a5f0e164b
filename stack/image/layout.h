// SPDX-License-Identifier: Apache-2.0
// The place of every process value of a line: the entry table of one direction.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "stack/base/time.h"
#include "stack/od/data_type.h"
#include "stack/od/description.h"
#include "stack/od/scaling.h"

namespace linegate::image {

// Seen from the gateway: inputs come from the devices, outputs go to them.
enum class Direction : std::uint8_t { inputs, outputs };

constexpr std::string_view name(Direction direction) {
  return direction == Direction::inputs ? "inputs" : "outputs";
}

inline constexpr std::uint32_t kMaxAreaBytes = 131'072;

// The numbers of SRDOs 1 to 64 (EN 50325-5) of a device where those of its PDOs are expected.
inline constexpr std::uint16_t kFirstSrdo = 513;
inline constexpr std::uint16_t kLastSrdo = 576;
constexpr bool is_srdo(std::uint16_t remote_pdo) {
  return remote_pdo >= kFirstSrdo && remote_pdo <= kLastSrdo;
}

// "PDO 1", or "SRDO 1" of that.
std::string pdo_text(std::uint16_t remote_pdo);
// In a table: "1", or "SRDO1".
std::string pdo_cell(std::uint16_t remote_pdo);

// The place of one object in the image.
struct Entry {
  std::uint32_t bit_offset = 0;  // from the start of the area; bit 0 is the lowest of byte 0
  std::uint16_t bit_length = 0;  // whole-byte values are aligned to their size (1, 2, 4, 8)
  od::DataType type = od::DataType::none;
  std::uint8_t node = 0;    // the device, 1..127
  std::uint16_t index = 0;  // the object in the device
  std::uint8_t sub = 0;
  std::uint16_t remote_pdo = 0;      // 1..512: the device's TPDO (inputs) or RPDO (outputs);
                                     // 513..576: its SRDO 1..64 (inputs)
  std::uint16_t local_pdo = 0;       // 1..512: RPDO (inputs) or TPDO (outputs) in the manager's own
                                     // dictionary; above 512, and of an SRDO: consumed without an
                                     // object of its own; 0: an object of the own node without a
                                     // linked PDO
  std::uint16_t variable_index = 0;  // CiA 302-4 network variable A000h..A8FFh that shows the same
  std::uint8_t variable_sub = 0;     // bytes; 0 = beyond that area, only in the image
  std::uint16_t profile = 0;         // CiA device profile of the node, 1000h bits 0-15
  std::uint32_t product_code = 0;    // 1018h:2 according to its device file, 0 = unknown
  std::string name;                  // names of the node and the object, "drive1.Statusword";
                                     // unique in the layout
  // What the value means to people. Numbers below are in the unit of the scaling.
  od::Scaling scaling;
  std::optional<double> low;  // limits of the value; of integers and reals alone
  std::optional<double> high;
  std::optional<double> initial;       // outputs: the value until the first write (a default of the
                                       // configuration); of integers, reals and BOOLEAN alone
  od::Access access = od::Access::rw;  // of the object in the device
  // Of the device's PDO; 0 without one. The inhibit time of an RPDO is that of its sender.
  std::uint8_t transmission_type = 0;
  Duration inhibit{};
  Duration event_timer{};
  std::optional<std::uint16_t> group;  // outputs: the group that writes it; nothing = in no group
};

// A value of more than 64 bits is exchanged in parts of 8 bytes, the last of which may have fewer;
// another value is one part.
constexpr std::uint32_t value_parts(std::uint32_t bits) {
  return bits <= 64 ? 1 : (bits + 63) / 64;
}
inline std::uint32_t value_parts(const Entry& entry) {
  return value_parts(std::uint32_t{entry.bit_length});
}

struct Layout {
  Direction direction = Direction::inputs;
  // Hash of direction, size and entries without their names, groups and initial values: the same
  // after a restart, and for an observer and a manager of the same line. Never 0.
  std::uint64_t id = 0;
  std::uint32_t byte_size = 0;
  std::vector<Entry> entries;  // ascending by local PDO and position; those without a PDO last
};

// Renames entries whose name an earlier entry has to "NAME in PDO 2", with the number of the
// device's PDO ("in SRDO 1" of an SRDO), or to "NAME #2".
void make_names_unique(Layout& layout);

// The hash for Layout::id: FNV-1a (64 bit) of direction, size and entries without their names,
// groups and initial values.
std::uint64_t layout_id(const Layout& layout);

}  // namespace linegate::image
