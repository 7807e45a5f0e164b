// SPDX-License-Identifier: Apache-2.0
#include "bridges/named/ros2_types.h"

#include <algorithm>
#include <cctype>
#include <set>
#include <utility>

#include "bridges/named/identifiers.h"
#include "bridges/named/type_parts.h"

namespace linegate::named {
namespace {

char in_upper_case(char c) {
  return static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
}

char in_lower_case(char c) {
  return static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
}

// "mixing_station" is "MixingStation": the name of a message has letters and digits.
std::string in_camel_case(std::string_view identifier) {
  std::string out;
  bool begins = true;
  for (const char c : identifier) {
    if (c != '_') {
      out += begins ? in_upper_case(c) : c;
    }
    begins = c == '_';
  }
  return out;
}

std::string message_name(const DeviceType& type) {
  const std::string hash = type.name.substr(type.name.rfind('_') + 1);
  return in_camel_case(identifier_of(type.line)) + in_camel_case(identifier_of(type.device)) +
         in_camel_case(image::name(type.direction)) + hash;
}

std::string complaint_about(const DeviceType& type, std::set<std::string>& topics) {
  const std::string of = std::string(image::name(type.direction)) + " of line " + type.line +
                         ", device " + type.device + ": ";
  if (identifier_of(type.line).empty() || identifier_of(type.device).empty()) {
    return of + "ROS 2 needs names with letters or digits";
  }
  if (!topics.insert(ros2_topic(type)).second) {
    return of + "another device has the topic " + ros2_topic(type) +
           " of ROS 2, too: give it another name";
  }
  std::set<std::string> fields;
  for (const Member& member : type.members) {
    if (!fields.insert(ros2_field(member.identifier)).second) {
      return of + "two members are called " + ros2_field(member.identifier) +
             " in ROS 2: give one of them an alias";
    }
  }
  return {};
}

}  // namespace

Ros2Types ros2_types(std::span<const DeviceType> types) {
  Ros2Types out;
  std::set<std::string> topics;
  for (const DeviceType& type : types) {
    if (std::string why = complaint_about(type, topics); !why.empty()) {
      out.collisions.push_back(std::move(why));
      continue;
    }
    out.types.push_back(type);
    out.types.back().name = message_name(type);
    out.types.back().ros2 = true;
    out.types.back().described = false;
  }
  return out;
}

std::string ros2_topic(const DeviceType& type) {
  return "rt/" + std::string(kModule) + '/' + identifier_of(type.line) + '/' +
         identifier_of(type.device) + '/' + std::string(image::name(type.direction));
}

std::string ros2_type_name(std::string_view message) {
  return std::string(kRos2Package) + "::msg::dds_::" + std::string(message) + '_';
}

// A reserved word has an underscore at its end, which no field may have.
std::string ros2_field(std::string_view identifier) {
  std::string out(identifier);
  std::ranges::transform(out, out.begin(), in_lower_case);
  return out.ends_with('_') ? out + "value" : out;
}

}  // namespace linegate::named
