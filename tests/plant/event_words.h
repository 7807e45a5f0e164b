// SPDX-License-Identifier: Apache-2.0
// Events in the words of scenarios: the members of stack/base/events.h by their names.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "stack/base/events.h"

namespace linegate::plant {

// The number in the member of that name; nothing if the kind has no such member.
std::optional<std::uint64_t> member_of(const EventData& data, std::string_view name);

// All members, each as " name=value"; bytes as numbers with dots between.
std::string members_text(const EventData& data);

}  // namespace linegate::plant
