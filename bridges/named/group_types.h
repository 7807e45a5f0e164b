// SPDX-License-Identifier: Apache-2.0
// The types of the topics by which applications write outputs by name: one struct for each group of
// outputs that is configured so, with a member for each output and a mark whether it is given.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "bridges/named/device_types.h"
#include "stack/image/layout.h"

namespace linegate::named {

// A group of outputs that is written by name.
struct Group {
  std::string name;
  std::uint16_t number = 0;
  std::vector<std::uint32_t> entries;  // of the output layout, in any order

  friend bool operator==(const Group&, const Group&) = default;
};

struct GroupType {
  std::string line;
  std::string group;
  std::uint16_t number = 0;     // of the group
  std::uint64_t layout_id = 0;  // of the output layout that the entries of its members refer to
  // Of the struct, in the module `plant`: line, group, and a hash of everything that a writer must
  // know to make a sample.
  std::string name;
  // In the order of the layout, at least one. The identifier begins with that of the device, and
  // object_name is the name of the entry.
  std::vector<Member> members;

  // "plant::press_drives_set_..."; the name of the type in DDS.
  std::string type_name() const;
  // "plant/press/drives/outputs/set"
  std::string topic() const;
};
// Whether the name of a topic has the form of GroupType::topic(). Topics of devices never have it.
bool is_set_topic(std::string_view topic);

struct GroupTypes {
  std::vector<GroupType> types;  // in the order of the groups
  // A sentence for each reason why a group has no type.
  std::vector<std::string> collisions;
};

// outputs: the layout of the outputs of the line.
GroupTypes group_types(std::string_view line, const image::Layout& outputs,
                       std::span<const Group> groups, std::span<const Alias> aliases = {});

}  // namespace linegate::named
