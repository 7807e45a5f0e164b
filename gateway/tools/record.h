// SPDX-License-Identifier: Apache-2.0
// `linegate record`: writes the frames of an interface to a candump log.
#pragma once

#include <string>

#include "gateway/config/plant.h"

namespace linegate::gateway {

struct RecordOptions {
  std::string uri;      // "socketcan:can0"
  config::Record file;  // an empty name selects standard output
};

// Sends nothing. Records until a stop signal, or the end of a replay; call block_stop_signals()
// before. Prints errors on standard error and returns the exit code: an error also if frames that
// were received are not in the file.
int record(const RecordOptions& options);

}  // namespace linegate::gateway
