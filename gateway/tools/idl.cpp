// SPDX-License-Identifier: Apache-2.0
#include "gateway/tools/idl.h"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <iterator>
#include <optional>
#include <system_error>
#include <utility>

#include "bridges/named/device_types.h"
#include "bridges/named/group_types.h"
#include "bridges/named/idl_text.h"
#include "bridges/named/ros2_types.h"
#include "gateway/runtime/exit_code.h"
#include "gateway/runtime/log.h"
#include "gateway/tools/check_parts.h"
#include "stack/line/line.h"

namespace linegate::gateway {
namespace {

struct LineTypes {
  std::vector<named::DeviceType> devices;
  std::vector<named::GroupType> groups;
  std::vector<std::string> collisions;
};

// The types of a line: of each device its inputs and then its outputs, in the order of the layouts;
// of each group that is written by name.
LineTypes types_of(const config::LinePlan& plan) {
  LineTypes out;
  const auto made = line::Line::make(as_started(plan.config));
  if (!made.value) {
    const auto error = std::ranges::find(made.diagnostics, Severity::error, &Diagnostic::severity);
    out.collisions.push_back(to_string(*error));
    return out;
  }
  for (const auto direction : {image::Direction::inputs, image::Direction::outputs}) {
    named::DeviceTypes some =
        named::device_types(plan.config.name, (*made.value)->layout(direction), plan.named.aliases);
    std::ranges::move(some.types, std::back_inserter(out.devices));
    std::ranges::move(some.collisions, std::back_inserter(out.collisions));
  }
  std::ranges::stable_sort(out.devices, {}, &named::DeviceType::node);
  named::GroupTypes groups =
      named::group_types(plan.config.name, (*made.value)->layout(image::Direction::outputs),
                         plan.named.groups, plan.named.aliases);
  out.groups = std::move(groups.types);
  std::ranges::move(groups.collisions, std::back_inserter(out.collisions));
  return out;
}

bool is_named(const named::DeviceType& type, const std::string& device) {
  return type.device == device || std::to_string(type.node) == device;
}

std::optional<PlantIdl> load_idl(const std::string& path, const std::string& of) {
  const auto loaded = config::load(path);
  print(loaded.diagnostics);
  return loaded.value ? std::optional(idl_of(*loaded.value, of)) : std::nullopt;
}

// Returns false if there are any.
bool print_errors(const std::vector<std::string>& errors) {
  for (const std::string& error : errors) {
    std::cerr << error << '\n';
  }
  return errors.empty();
}

std::string text_of(const std::filesystem::path& file) {
  std::ifstream in(file);
  return {std::istreambuf_iterator<char>(in), {}};
}

// Removes the messages of a package that was written before. Returns false if the folder has other
// files instead.
bool make_room(const std::filesystem::path& folder) {
  std::error_code error;
  if (!std::filesystem::exists(folder, error) || std::filesystem::is_empty(folder, error)) {
    return true;
  }
  if (text_of(folder / "package.xml").find(named::kRos2Marker) == std::string::npos) {
    return false;
  }
  for (const std::string& message : named::ros2_messages_of(text_of(folder / "CMakeLists.txt"))) {
    std::filesystem::remove(folder / message, error);
  }
  return true;
}

bool write(const std::filesystem::path& file, const std::string& text) {
  std::error_code error;
  std::filesystem::create_directories(file.parent_path(), error);
  errno = 0;
  if (std::ofstream(file) << text << std::flush) {
    return true;
  }
  std::cerr << file.string() << " cannot be written: " << std::strerror(errno) << '\n';
  return false;
}

}  // namespace

PlantIdl idl_of(const config::Plant& plant, const std::string& of) {
  const std::size_t colon = std::min(of.find(':'), of.size());
  const std::string line = of.substr(0, colon);
  const std::string part = of.substr(std::min(colon + 1, of.size()));
  PlantIdl out;
  std::vector<named::DeviceType> types;
  std::vector<named::GroupType> groups;
  bool known = of.empty();
  for (const config::LinePlan& plan : plant.lines) {
    if (!of.empty() && plan.config.name != line && std::to_string(plan.config.network_id) != line) {
      continue;
    }
    known = true;
    LineTypes made = types_of(plan);
    std::ranges::move(made.collisions, std::back_inserter(out.errors));
    std::ranges::copy_if(made.devices, std::back_inserter(types),
                         [&](const auto& type) { return part.empty() || is_named(type, part); });
    std::ranges::copy_if(made.groups, std::back_inserter(groups),
                         [&](const auto& type) { return part.empty() || type.group == part; });
  }
  if (!known) {
    out.errors.push_back("there is no line " + line);
  } else if (types.empty() && groups.empty() && out.errors.empty()) {
    out.errors.push_back((of.empty() ? plant.file : of) + " has no process data in this plant");
  }
  out.text = named::idl_text(types, groups);
  named::Ros2Types messages = named::ros2_types(types);
  out.ros2 = named::ros2_package(messages.types);
  out.ros2_errors = std::move(messages.collisions);
  if (types.empty()) {
    out.ros2_errors.push_back((of.empty() ? plant.file : of) + " has no device with process data");
  }
  return out;
}

int print_idl(const std::string& path, const std::string& of) {
  const std::optional<PlantIdl> idl = load_idl(path, of);
  if (!idl || !print_errors(idl->errors)) {
    return kExitUsage;
  }
  std::cout << idl->text;
  return kExitOk;
}

int write_ros2_package(const std::string& path, const std::string& of, const std::string& folder) {
  const std::optional<PlantIdl> idl = load_idl(path, of);
  if (!idl || !print_errors(idl->errors) || !print_errors(idl->ros2_errors)) {
    return kExitUsage;
  }
  const std::filesystem::path to(folder);
  if (!make_room(to)) {
    std::cerr << folder << " is no message package of linegate idl: give a new or empty folder\n";
    return kExitUsage;
  }
  // In this order package.xml is the first: if another cannot be written, make_room() knows the
  // folder.
  const bool written = std::all_of(idl->ros2.rbegin(), idl->ros2.rend(), [&](const auto& file) {
    return write(to / file.first, file.second);
  });
  return written ? kExitOk : kExitFailed;
}

}  // namespace linegate::gateway
