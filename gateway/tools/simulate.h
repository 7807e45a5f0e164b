// SPDX-License-Identifier: Apache-2.0
// Simulated devices on any interface, until SIGINT or SIGTERM: `linegate simulate`.
#pragma once

#include <string>
#include <vector>

namespace linegate::gateway {

struct SimulateOptions {
  std::string uri;                   // "socketcan:vcan0"; empty: that of the line
  std::vector<std::string> devices;  // "drive:5": profile and node-ID
  std::string plant;                 // a plant.yaml: all nodes of one of its lines
  std::string line;                  // its name; may be empty if there is only one
  std::string storage;               // folder for stored parameters; empty: forgotten at the end
};

// Waits for a stop signal: call block_stop_signals() before. Gives the exit code; what is wrong is
// printed on standard error.
int simulate(const SimulateOptions& options);

}  // namespace linegate::gateway
