// SPDX-License-Identifier: Apache-2.0
// OutputState of the contract from and to the stack's. gateway, line and incarnation are left
// alone.
#pragma once

#include <linegate.h>

#include "bridges/dds/clock_map.h"
#include "bridges/dds/values.h"
#include "stack/line/output_state.h"

namespace linegate::dds {

// now: of the sample.
void to_wire(const line::OutputState& from, const ClockMap& clock, Instant now,
             v1::OutputState& to);
// The deadline is what is left of the watchdog time, after the time of the sample.
void from_wire(const v1::OutputState& from, const ClockMap& clock, line::OutputState& to);

}  // namespace linegate::dds
