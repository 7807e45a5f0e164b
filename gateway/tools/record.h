// SPDX-License-Identifier: Apache-2.0
// What is on an interface, as candump log: `linegate record`.
#pragma once

#include <string>

#include "gateway/config/plant.h"

namespace linegate::gateway {

struct RecordOptions {
  std::string uri;      // "socketcan:can0"
  config::Record file;  // an empty name: standard output
};

// Sends nothing. Until a stop signal, or the end of a replay: call block_stop_signals() before.
// Gives the exit code; what is wrong is printed on standard error.
int record(const RecordOptions& options);

}  // namespace linegate::gateway
