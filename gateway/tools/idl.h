// SPDX-License-Identifier: Apache-2.0
// `linegate idl`: the IDL of the named topics of a plant, and its message package for ROS 2.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "gateway/config/plant.h"

namespace linegate::gateway {

struct PlantIdl {
  std::string text;
  std::map<std::string, std::string> ros2;  // texts of the message package by their files
  std::vector<std::string> errors;          // sentences; if there are any, the text is not complete
  std::vector<std::string> ros2_errors;     // the same, of the package
};

// of: empty for all lines, LINE, LINE:DEVICE or LINE:GROUP ("press", "press:ram"). LINE is a name
// or a network-ID, DEVICE a name or a node-ID, GROUP the name of a group of outputs that is written
// by name. The text depends on the selected lines alone.
PlantIdl idl_of(const config::Plant& plant, const std::string& of);

// Loads a plant.yaml and prints the IDL on standard output, or errors on standard error. Returns
// the exit code: kExitOk or kExitUsage.
int print_idl(const std::string& path, const std::string& of);

// Writes the message package into a folder that does not exist or is empty, or over one that it
// wrote before, whose messages are removed. Returns the exit code: kExitOk, kExitUsage, or
// kExitFailed if a file cannot be written.
int write_ros2_package(const std::string& path, const std::string& of, const std::string& folder);

}  // namespace linegate::gateway
