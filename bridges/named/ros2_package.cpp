// SPDX-License-Identifier: Apache-2.0
// The message package of ROS 2 (rosidl). A message has the members of the struct that idl_text.cpp
// prints, in the same order: its samples have the same octets.
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "bridges/named/member_text.h"
#include "bridges/named/ros2_types.h"

namespace linegate::named {
namespace {

constexpr std::string_view kPackageXml = R"(<?xml version="1.0"?>
<!-- @MARKER@ -->
<package format="3">
  <name>@PACKAGE@</name>
  <version>0.0.0</version>
  <description>Devices of a Linegate plant: one message for each device and direction</description>
  <maintainer email="operator@example.com">the operator of the plant</maintainer>
  <license>none</license>
  <buildtool_depend>ament_cmake</buildtool_depend>
  <buildtool_depend>rosidl_default_generators</buildtool_depend>
  <exec_depend>rosidl_default_runtime</exec_depend>
  <member_of_group>rosidl_interface_packages</member_of_group>
  <export>
    <build_type>ament_cmake</build_type>
  </export>
</package>
)";

constexpr std::string_view kCMakeHead = R"(# @MARKER@
cmake_minimum_required(VERSION 3.8)
project(@PACKAGE@)
find_package(ament_cmake REQUIRED)
find_package(rosidl_default_generators REQUIRED)
rosidl_generate_interfaces(${PROJECT_NAME}
)";

constexpr std::string_view kCMakeTail = R"()
ament_export_dependencies(rosidl_default_runtime)
ament_package()
)";

std::string filled_in(std::string_view text) {
  std::string out(text);
  for (const auto& [place, what] :
       {std::pair{std::string_view("@PACKAGE@"), kRos2Package}, {"@MARKER@", kRos2Marker}}) {
    out.replace(out.find(place), place.size(), what);
  }
  return out;
}

std::string_view field_type_of(Form form) {
  switch (form) {
    case Form::boolean:
      return "bool";
    case Form::int8:
      return "int8";
    case Form::uint8:
    case Form::octets:
      return "uint8";
    case Form::int16:
      return "int16";
    case Form::uint16:
      return "uint16";
    case Form::int32:
      return "int32";
    case Form::uint32:
      return "uint32";
    case Form::int64:
      return "int64";
    case Form::uint64:
      return "uint64";
    case Form::float32:
      return "float32";
    case Form::float64:
      return "float64";
    case Form::text:
      break;
  }
  return "string";
}

class Messages {
 public:
  explicit Messages(std::map<std::string, std::string>& files) : files_(files) {}

  void add(const DeviceType& type) {
    const bool is_input = type.direction == image::Direction::inputs;
    const std::string times = is_input ? "received" : "sent";
    const std::string& name = type.name;
    std::string text = "# Topic " + ros2_topic(type).substr(2) + '\n';
    text += "string<=64 gateway\n";
    text += "string<=64 line\n";
    text += "uint64 incarnation  # random for each start of the gateway\n";
    text += "uint64 sequence_number  # 1, 2, ...: a gap means lost samples\n";
    text += "int64 time  # acquisition of the process image; UTC, ns since 1970\n";
    text += "uint8 clock  # ClockQuality of linegate.idl\n";
    if (!type.pdos.empty()) {
      text += name + (is_input ? "Received " : "Sent ") + times +
              "  # newest frame of each PDO; UTC, ns since 1970, 0 = never\n";
      add_times(name + (is_input ? "Received" : "Sent"), type);
    }
    text += name + "Valid valid\n";
    add_marks(name + "Valid", type);
    if (!is_input) {
      text += name + "Known known  # written, or has a default\n";
      add_marks(name + "Known", type);
      text += name + "Waits waits  # 0 if valid, else OutputWait of linegate.idl + 1\n";
      add_marks(name + "Waits", type, "uint8");
    }
    text += name + "Values values  # 0 or empty unless " + (is_input ? "valid" : "known") + '\n';
    add_values(name + "Values", type);
    add_file(name, std::move(text));
  }

 private:
  void add_file(const std::string& message, std::string text) {
    files_["msg/" + message + ".msg"] = std::move(text);
  }
  void add_times(const std::string& message, const DeviceType& type) {
    std::string text;
    for (const std::uint16_t pdo : type.pdos) {
      text += "int64 " + time_member(pdo) + '\n';
    }
    add_file(message, std::move(text));
  }
  void add_marks(const std::string& message, const DeviceType& type,
                 const std::string& kind = "bool") {
    std::string text;
    for (const Member& member : type.members) {
      text += kind + ' ' + ros2_field(member.identifier) + '\n';
    }
    add_file(message, std::move(text));
  }
  void add_values(const std::string& message, const DeviceType& type) {
    std::string text;
    for (const Member& member : type.members) {
      text += field_type_of(member.form);
      if (member.form == Form::text) {
        text += "<=" + std::to_string(member.length);
      } else if (member.form == Form::octets) {
        text += '[' + std::to_string(member.length) + ']';
      }
      text += ' ' + ros2_field(member.identifier) + "  # " + comment_of(member) + '\n';
    }
    add_file(message, std::move(text));
  }

  std::map<std::string, std::string>& files_;
};

}  // namespace

std::vector<std::string> ros2_messages_of(std::string_view cmake) {
  constexpr std::string_view kBegin = "\n  \"msg/";
  constexpr std::string_view kName = "msg/";
  std::vector<std::string> out;
  for (auto at = cmake.find(kBegin); at != std::string_view::npos;
       at = cmake.find(kBegin, at + 1)) {
    const auto begin = at + kBegin.size() - kName.size();
    const std::string_view name = cmake.substr(begin, cmake.find('"', begin) - begin);
    if (name.ends_with(".msg") && name.find('/', kName.size()) == std::string_view::npos) {
      out.emplace_back(name);
    }
  }
  return out;
}

std::map<std::string, std::string> ros2_package(std::span<const DeviceType> types) {
  std::map<std::string, std::string> files;
  Messages messages(files);
  for (const DeviceType& type : types) {
    messages.add(type);
  }
  std::string cmake = filled_in(kCMakeHead);
  for (const auto& [path, text] : files) {
    cmake += "  \"" + path + "\"\n";
  }
  files["CMakeLists.txt"] = cmake + std::string(kCMakeTail);
  files["package.xml"] = filled_in(kPackageXml);
  return files;
}

}  // namespace linegate::named
