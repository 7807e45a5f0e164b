// SPDX-License-Identifier: Apache-2.0
// `linegate replay`: sends the frames of a candump log on an interface.
#pragma once

#include <string>

namespace linegate::gateway {

struct ReplayCommand {
  std::string file;
  std::string uri;            // destination, "socketcan:can0"
  std::string speed = "1";    // a factor, or "max"
  std::string log_interface;  // only frames of this interface in the log; empty: all
};

// Skips error frames, which cannot be sent. Ends with the log, or at a stop signal; call
// block_stop_signals() before. Prints errors on standard error and returns the exit code.
int replay(const ReplayCommand& command);

}  // namespace linegate::gateway
