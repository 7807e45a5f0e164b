// SPDX-License-Identifier: Apache-2.0
// `linegate scan`: what is on a line, printed, and as files if that is wanted.
#pragma once

#include <string>

#include "bridges/console/scan.h"

namespace linegate::gateway {

struct ScanTarget {
  std::string folder;  // for plant.yaml and DCF files; empty = none is written
  std::string eds;     // folder of EDS files for names and exact types; empty = none
  unsigned domain = 0;
};

// Gives the exit code.
int scan_and_write(console::Context& context, console::ScanRequest request,
                   const ScanTarget& target);

}  // namespace linegate::gateway
