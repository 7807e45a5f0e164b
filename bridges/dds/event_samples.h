// SPDX-License-Identifier: Apache-2.0
// Converts the stack's Event to that of the contract, and that to a ReceivedEvent. gateway, line
// and incarnation are unchanged.
#pragma once

#include <string_view>

#include <linegate.h>

#include "bridges/dds/clock_map.h"
#include "bridges/dds/values.h"
#include "stack/base/event.h"

namespace linegate::dds {

void to_wire(const linegate::Event& from, std::string_view text, const ClockMap& clock,
             v1::Event& to);
// Adds the property that states the stream of the number, if there is room for it; 0: does not.
void add_stream(std::uint64_t stream, v1::Event& to);
// data beyond 64 bytes are cut off. The stream is 0 if the properties do not state it.
void from_wire(const v1::Event& from, const ClockMap& clock, ReceivedEvent& to);

}  // namespace linegate::dds
