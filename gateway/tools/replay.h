// SPDX-License-Identifier: Apache-2.0
// Sends the frames of a candump log on an interface: `linegate replay`.
#pragma once

#include <string>

namespace linegate::gateway {

struct ReplayCommand {
  std::string file;
  std::string uri;            // where they are sent, "socketcan:can0"
  std::string speed = "1";    // a factor, or "max"
  std::string log_interface;  // only the frames of this interface in the log; empty: all
};

// Error frames cannot be sent and are left out. Until the log is at its end, or a stop signal: call
// block_stop_signals() before. Gives the exit code; what is wrong is printed on standard error.
int replay(const ReplayCommand& command);

}  // namespace linegate::gateway
