// SPDX-License-Identifier: Apache-2.0
// A candump log, explained line by line: `linegate decode`.
#pragma once

#include <string>

namespace linegate::gateway {

struct DecodeOptions {
  std::string file;   // "-": the standard input, line by line as it comes
  std::string plant;  // a plant.yaml; empty: the pre-defined identifiers alone
  std::string line;   // of the plant; empty: by the interface that the log names
  bool json = false;  // an object a frame
};

// Prints on standard output. A line that is none is told on standard error, and makes the exit code
// that of a failure.
int decode(const DecodeOptions& options);

}  // namespace linegate::gateway
