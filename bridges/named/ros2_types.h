// SPDX-License-Identifier: Apache-2.0
// Named topics for nodes of ROS 2: the types of devices as messages, whose samples have the same
// octets. README.md has the rule for their names.
#pragma once

#include <map>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "bridges/named/device_types.h"

namespace linegate::named {

// The package of all messages.
inline constexpr std::string_view kRos2Package = "linegate_plant";

struct Ros2Types {
  std::vector<DeviceType> types;  // the same samples as messages; the name of each is its message's
  // A sentence for each type that cannot be a message: another one has its topic, a name has
  // neither letter nor digit, or two members have the same name.
  std::vector<std::string> collisions;
};

Ros2Types ros2_types(std::span<const DeviceType> types);

// The files of the package by their paths: package.xml, CMakeLists.txt and msg/*.msg. types: those
// of ros2_types().
std::map<std::string, std::string> ros2_package(std::span<const DeviceType> types);

// What each package.xml has, and the messages that a CMakeLists.txt of a package names:
// "msg/PressRamInputs....msg".
inline constexpr std::string_view kRos2Marker =
    "Written by `linegate idl` with its option for ROS 2.";
std::vector<std::string> ros2_messages_of(std::string_view cmake);

// "rt/plant/press/ram/inputs"; ROS 2 omits "rt/".
std::string ros2_topic(const DeviceType& type);
// Of a message, in DDS.
std::string ros2_type_name(std::string_view message);
// Of a member with that identifier.
std::string ros2_field(std::string_view identifier);

}  // namespace linegate::named
