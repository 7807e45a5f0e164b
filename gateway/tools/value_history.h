// SPDX-License-Identifier: Apache-2.0
// `linegate history --journal --values`: the value history of a journal (gateway/journal).
#pragma once

#include <string>

#include "bridges/console/history.h"
#include "stack/base/time.h"

namespace linegate::gateway {

// Prints the values with the pages that a gateway answers, in the order in which they were stored.
// now: UTC. Returns the exit code of console::values_of().
int value_history(const std::string& file, const console::HistoryRequest& request, Instant now,
                  const console::HistoryOutput& output);

}  // namespace linegate::gateway
