// SPDX-License-Identifier: Apache-2.0
// How the gateway's programs log: one line an entry on standard error, with UTC time; into the
// journal with the severities it knows, and without a time, which it has itself.
#pragma once

#include <vector>

#include "gateway/config/plant.h"
#include "stack/base/diagnostic.h"

namespace linegate::gateway {

void set_up_log(config::LogLevel level);

// While it runs.
void set_log_level(config::LogLevel level);

// Each diagnostic as compilers print it, on standard error.
void print(const std::vector<Diagnostic>& diagnostics);

// Each as an entry of the log.
void log(const std::vector<Diagnostic>& diagnostics);

}  // namespace linegate::gateway
