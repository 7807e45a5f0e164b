// SPDX-License-Identifier: Apache-2.0
// `linegate decode`: explains a candump log line by line.
#pragma once

#include <string>

namespace linegate::gateway {

struct DecodeOptions {
  std::string file;   // "-": standard input, line by line as it arrives
  std::string plant;  // a plant.yaml; empty: decode the pre-defined connection set only
  std::string line;   // line of the plant; empty: selected by the interface in the log
  bool json = false;  // one JSON object for each frame
};

// Prints on standard output. A malformed line is reported on standard error, and the exit code is
// then that of a failure.
int decode(const DecodeOptions& options);

}  // namespace linegate::gateway
