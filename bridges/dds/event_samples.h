// SPDX-License-Identifier: Apache-2.0
// Converts between Event of the contract and the stack's. gateway, line and incarnation are
// unchanged.
#pragma once

#include <string_view>

#include <linegate.h>

#include "bridges/dds/clock_map.h"
#include "stack/base/event.h"

namespace linegate::dds {

void to_wire(const linegate::Event& from, std::string_view text, const ClockMap& clock,
             v1::Event& to);
// Event kinds that are unknown to this version keep their number.
void from_wire(const v1::Event& from, const ClockMap& clock, linegate::Event& to);

}  // namespace linegate::dds
