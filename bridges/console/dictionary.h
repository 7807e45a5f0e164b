// SPDX-License-Identifier: Apache-2.0
// `linegate od`: the object dictionary of a line's own node.
#pragma once

#include <string>

#include "bridges/console/commands.h"

namespace linegate::console {

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
