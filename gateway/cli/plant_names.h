// SPDX-License-Identifier: Apache-2.0
// Names of a plant.yaml for completion by a shell: `linegate names --plant`.
#pragma once

#include <string>

namespace linegate::gateway {

// Prints its lines and nodes as console::completions() has them. Says nothing of what is wrong with
// the file; gives the exit code.
int print_names(const std::string& path);

}  // namespace linegate::gateway
