// SPDX-License-Identifier: Apache-2.0
// `linegate eds` and `linegate dcf`: write device files (CiA 306) of a plant.
#pragma once

#include <cstdint>
#include <string>

#include "gateway/config/plant.h"

namespace linegate::gateway {

enum class DeviceFileKind : std::uint8_t {
  eds,      // of a line's own node: its object dictionary
  dcf,      // of a node of a line: its device file with all configured values
  concise,  // configured values only, as a concise DCF for object 1F22h (CiA 302-3): binary
};

struct DeviceFile {
  bool ok = false;
  std::string content;  // or an error message
};

// of: the line for eds ("press"), LINE:NODE for the other kinds ("press:5", "press:ram"). LINE is a
// name or a network-ID, NODE a name or a node-ID.
DeviceFile write_device_file(const config::Plant& plant, const std::string& of,
                             DeviceFileKind kind);

// Loads a plant.yaml and prints the file on standard output, or errors on standard error. Returns
// the exit code: kExitOk or kExitUsage.
int print_device_file(const std::string& path, const std::string& of, DeviceFileKind kind);

}  // namespace linegate::gateway
