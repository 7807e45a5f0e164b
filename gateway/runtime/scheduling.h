// SPDX-License-Identifier: Apache-2.0
// Real time for the calling thread, as far as the configuration wants it and the system permits it.
#pragma once

#include "gateway/config/plant.h"

namespace linegate::gateway {

// Priority, processor and locked memory of the plan. What is not permitted is a warning in the log,
// and the thread runs on without it.
void apply_scheduling(const config::ExecutorPlan& plan);

}  // namespace linegate::gateway
