// SPDX-License-Identifier: Apache-2.0
// The parameters of an event from and to the members code, value and data of an Event sample: one
// codec for each kind. The layouts are in linegate.idl, and in the comment of each codec.
#pragma once

#include <optional>

#include "bridges/dds/values.h"
#include "stack/base/events.h"

namespace linegate::dds {

EventFields pack(const EventData& data);

// Missing data count as 0, and numbers that a member cannot represent lose their high bits: the
// sample may be of another version. nullopt if the kind is unknown to this version.
std::optional<EventData> unpack(EventKind kind, const EventFields& fields);

}  // namespace linegate::dds
