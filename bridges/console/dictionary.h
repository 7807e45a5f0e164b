// SPDX-License-Identifier: Apache-2.0
// `linegate od`: the object dictionary of a line's own node.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "bridges/console/commands.h"
#include "stack/od/data_type.h"
#include "stack/od/description.h"

namespace linegate::console {

// A variable in the list that a line returns.
struct ListedVariable {
  od::Address address;
  od::DataType type = od::DataType::none;
  od::Access access = od::Access::ro;
  bool mappable = false;
  bool stored = false;
  bool application = false;
  std::string name;
  std::vector<std::byte> value;  // also empty if it cannot be read
};
// Decodes the format of line::list_objects(). Returns nothing if it is malformed.
std::optional<std::vector<ListedVariable>> decode_list(std::span<const std::byte> data);

// The arguments as typed.
struct NewObject {
  std::string index;      // hexadecimal
  std::string sub = "0";  // hexadecimal
  std::string type;
  std::string name;
  std::string access = "rw";
  std::string value;  // default; empty = 0
  std::string low;    // empty = none
  std::string high;
  std::string offset;  // byte offset in the image; empty = not in the image
  bool mappable = false;
};

// line: list, read and write also take LINE:NODE, a device of a line in the role device. An empty
// index lists all objects except the network variables.
int od_list(Context& context, const std::string& line, const std::string& index);
int od_read(Context& context, const std::string& line, const std::string& index,
            const std::string& sub);
// Uses the data type of the dictionary. own: write as the device itself, whatever the access of the
// object.
int od_write(Context& context, const std::string& line, const std::string& index,
             const std::string& sub, const std::string& value, bool own = false);
int od_create(Context& context, const std::string& line, const NewObject& object);
int od_remove(Context& context, const std::string& line, const std::string& index);

}  // namespace linegate::console
