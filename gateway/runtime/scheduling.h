// SPDX-License-Identifier: Apache-2.0
// Real-time scheduling for the calling thread, as configured and as far as the system permits it.
#pragma once

#include "gateway/config/plant.h"

namespace linegate::gateway {

// Applies priority, processor and locked memory of the plan. A setting that is not permitted is
// logged as a warning, and the thread runs without it.
void apply_scheduling(const config::ExecutorPlan& plan);

}  // namespace linegate::gateway
