// SPDX-License-Identifier: Apache-2.0
// `linegate simulate`: simulates devices on any interface until SIGINT or SIGTERM.
#pragma once

#include <string>
#include <vector>

namespace linegate::gateway {

struct SimulateOptions {
  std::string uri;                   // "socketcan:vcan0"; empty: the interface of the line
  std::vector<std::string> devices;  // "drive:5": profile and node-ID
  std::string plant;                 // a plant.yaml: simulates all nodes of one of its lines
  std::string line;                  // name of the line; may be empty if there is only one
  std::string storage;  // folder for stored parameters; empty: they are discarded at the end
};

// Runs until a stop signal; call block_stop_signals() before. Prints errors on standard error and
// returns the exit code.
int simulate(const SimulateOptions& options);

}  // namespace linegate::gateway
