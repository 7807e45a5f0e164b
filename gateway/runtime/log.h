// SPDX-License-Identifier: Apache-2.0
// The log of the gateway's programs: one line for each entry on standard error, with UTC time. To
// the journal it writes the journal's severities, and no time, which the journal adds itself.
#pragma once

#include <vector>

#include "gateway/config/plant.h"
#include "stack/base/diagnostic.h"

namespace linegate::gateway {

void set_up_log(config::LogLevel level);

// May be called at any time.
void set_log_level(config::LogLevel level);

// Prints each diagnostic on standard error in the format of compilers.
void print(const std::vector<Diagnostic>& diagnostics);

// Logs each diagnostic as one entry.
void log(const std::vector<Diagnostic>& diagnostics);

}  // namespace linegate::gateway
