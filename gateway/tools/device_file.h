// SPDX-License-Identifier: Apache-2.0
// Device files (CiA 306) of a plant, written: `linegate eds` and `linegate dcf`.
#pragma once

#include <cstdint>
#include <string>

#include "gateway/config/plant.h"

namespace linegate::gateway {

enum class DeviceFileKind : std::uint8_t {
  eds,      // of a line's own node: its object dictionary as it is built
  dcf,      // of a node of a line: its device file with everything that is written to it
  concise,  // only what is written to it, as object 1F22h holds it (CiA 302-3): binary
};

struct DeviceFile {
  bool ok = false;
  std::string content;  // or why there is none
};

// of: the line for eds ("press"), LINE:NODE for the others ("press:5", "press:ram"). A line is
// named by its name or its network-ID, a node by its name or its node-ID.
DeviceFile write_device_file(const config::Plant& plant, const std::string& of,
                             DeviceFileKind kind);

// The same from a plant.yaml, to standard output; what is wrong goes to standard error. Gives the
// exit code: kExitOk or kExitUsage.
int print_device_file(const std::string& path, const std::string& of, DeviceFileKind kind);

}  // namespace linegate::gateway
