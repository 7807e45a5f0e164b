// SPDX-License-Identifier: Apache-2.0
// `linegate idl`: the IDL of the named topics of a plant.
#pragma once

#include <string>
#include <vector>

#include "gateway/config/plant.h"

namespace linegate::gateway {

struct PlantIdl {
  std::string text;
  std::vector<std::string> errors;  // sentences; if there are any, the text is not complete
};

// of: empty for all lines, LINE, LINE:DEVICE or LINE:GROUP ("press", "press:ram"). LINE is a name
// or a network-ID, DEVICE a name or a node-ID, GROUP the name of a group of outputs that is written
// by name. The text depends on the selected lines alone.
PlantIdl idl_of(const config::Plant& plant, const std::string& of);

// Loads a plant.yaml and prints the IDL on standard output, or errors on standard error. Returns
// the exit code: kExitOk or kExitUsage.
int print_idl(const std::string& path, const std::string& of);

}  // namespace linegate::gateway
