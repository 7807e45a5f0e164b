// SPDX-License-Identifier: Apache-2.0
// Converts between OutputState of the contract and the stack's. gateway, line and incarnation are
// unchanged.
#pragma once

#include <linegate.h>

#include "bridges/dds/clock_map.h"
#include "bridges/dds/values.h"
#include "stack/line/output_state.h"

namespace linegate::dds {

// now: time of the sample.
void to_wire(const line::OutputState& from, const ClockMap& clock, Instant now,
             v1::OutputState& to);
// The deadline is the time of the sample plus the remaining watchdog time.
void from_wire(const v1::OutputState& from, const ClockMap& clock, line::OutputState& to);

}  // namespace linegate::dds
