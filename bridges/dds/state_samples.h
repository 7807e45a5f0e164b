// SPDX-License-Identifier: Apache-2.0
// Converts between LineState and NodeState of the contract and the stack's values. gateway, line
// and incarnation are unchanged; from_wire() keeps unknown numbers. A text that is longer than its
// member ends with "...".
#pragma once

#include <vector>

#include <linegate.h>

#include "bridges/dds/clock_map.h"
#include "bridges/dds/values.h"
#include "stack/line/state.h"

namespace linegate::dds {

// Of more than kMaxProperties properties, the last one of `to` is `properties-left-out` instead:
// the number of those that are missing.
void to_wire(const std::vector<Property>& from, std::vector<v1::Property>& to);
void from_wire(const std::vector<v1::Property>& from, std::vector<Property>& to);

void to_wire(const LineInfo& info, const line::LineState& state, v1::LineState& to);
void from_wire(const v1::LineState& from, LineInfo& info, line::LineState& state);

void to_wire(const NodeInfo& info, const line::NodeState& state, const ClockMap& clock,
             v1::NodeState& to);
void from_wire(const v1::NodeState& from, const ClockMap& clock, NodeInfo& info,
               line::NodeState& state);

// Precondition: at most kMaxGatewayLines lines, as config::load() ensures. The last counter of `to`
// has event_stream. Of more than kMaxCounters - 1 counters, the one before it is
// `counters-left-out`: the number of those that are missing.
void to_wire(const GatewayInfo& info, const ClockMap& clock, v1::GatewayState& to);
void from_wire(const v1::GatewayState& from, const ClockMap& clock, GatewayInfo& info);

}  // namespace linegate::dds
